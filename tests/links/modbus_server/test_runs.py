from __future__ import annotations

import struct

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import Value, ValueKind
from gatewayd.links.modbus_server.plan import Placement
from gatewayd.links.modbus_server.runs import bit_runs, number_runs, words_of_bits
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import make_codec

INT32 = make_codec("int32", kind=ValueKind.INT, low=-(2**31), high=2**31 - 1)
SCALED = make_codec("int16", kind=ValueKind.FLOAT, scale=0.1)
UINT16_OF_INT32 = make_codec("uint16", kind=ValueKind.INT, low=-(2**31), high=2**31 - 1)


def number(variable: int, address: int, words: int = 2) -> Placement:
    return Placement(variable, Area.HOLDING, address, None, {1: UINT16_OF_INT32, 2: INT32}[words])


def test_plain_neighbours_are_one_run() -> None:
    placements = [number(1, 2), number(0, 0), number(2, 4), number(3, 8)]
    assert len(number_runs(placements, bytearray(100))) == 2


def test_what_needs_its_codec_is_a_run_of_its_own() -> None:
    placements = [number(0, 0), Placement(1, Area.HOLDING, 2, None, SCALED), number(2, 3)]
    image = bytearray(10)
    runs = number_runs(placements, image)
    assert len(runs) == 3
    for run in runs:
        run.refresh([1, 12.34, -1])
    assert image == struct.pack(">ihi", 1, 123, -1)


@given(st.permutations(range(6)), st.lists(st.integers(-(2**31), 2**31 - 1), min_size=6, max_size=6))
def test_a_run_follows_the_addresses_whatever_the_order_of_the_file(
    order: list[int], numbers: list[int]
) -> None:
    image = bytearray(24)
    values: list[Value] = [*numbers]
    for run in number_runs([number(variable, 2 * place) for place, variable in enumerate(order)], image):
        run.refresh(values)
    assert struct.unpack(">6i", image) == tuple(numbers[variable] for variable in order)


def test_only_what_changed_is_written() -> None:
    image = bytearray(8)
    (run,) = number_runs([number(0, 0), number(1, 2)], image)
    run.refresh([1, 2])
    image[:] = bytes(8)
    run.refresh([1, 2])
    assert image == bytes(8)
    run.refresh([1, 3])
    assert struct.unpack(">ii", image) == (1, 3)


def test_a_number_the_type_cannot_hold_is_left_to_the_codec() -> None:
    """A value beyond the robot's declared type must not stop the neighbours from being shown."""
    image = bytearray(8)
    (run,) = number_runs([number(0, 0), number(1, 2)], image)
    run.refresh([2**40, 5])
    assert struct.unpack(">ii", image) == (2**31 - 1, 5)


@given(
    st.integers(0, 20), st.lists(st.booleans(), min_size=1, max_size=40), st.binary(min_size=8, max_size=8)
)
def test_bits_are_packed_beside_those_of_others(first: int, bits: list[bool], others: bytes) -> None:
    image = bytearray(others)
    values: list[Value] = [*bits]
    (run,) = bit_runs(
        [Placement(index, Area.COIL, first + index, None, None) for index in range(len(bits))], image
    )
    run.refresh(values)
    before, after = int.from_bytes(others, "little"), int.from_bytes(image, "little")
    for position in range(64):
        own = first <= position < first + len(bits)
        assert bool(after >> position & 1) == (
            bits[position - first] if own else bool(before >> position & 1)
        )


def test_bits_of_one_register_are_one_word() -> None:
    image = bytearray(4)
    placements = [Placement(index, Area.HOLDING, 1, bit, None) for index, bit in enumerate((15, 0, 7))]
    runs = words_of_bits(placements, image)
    assert len(runs) == 1
    runs[0].refresh([True, False, True])
    assert image == bytes.fromhex("0000 8080")
