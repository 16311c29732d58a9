from __future__ import annotations

import struct
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.registers import Readable, RegisterImage
from gatewayd.modbus.areas import MAX_READ_BITS, MAX_READ_REGISTERS

IndexOf = Callable[[str], int]


@given(
    st.sets(st.integers(0, 65535) | st.integers(0, 300), max_size=300),
    st.sets(st.integers(0, 300), max_size=50),
    st.sampled_from([MAX_READ_REGISTERS, MAX_READ_BITS]),
)
def test_reach_is_the_number_of_readable_addresses_in_a_row(
    mapped: set[int], held_back: set[int], longest: int
) -> None:
    readable = Readable(mapped, longest)
    readable.hold_back(frozenset(held_back))
    for address in {*mapped, *(address + 1 for address in mapped), 0, 65535} - {65536}:
        for reach, there in ((readable.mapped, mapped), (readable.reach, mapped - held_back)):
            length = 0
            while address + length in there and length < longest:
                length += 1
            assert reach[address] == length


def test_holding_back_happens_in_place() -> None:
    """Connections keep a reference to the table."""
    readable = Readable(range(10), MAX_READ_REGISTERS)
    reach = readable.reach
    readable.hold_back(frozenset({5}))
    assert (reach[0], reach[5], reach[6]) == (5, 0, 4)
    readable.hold_back(frozenset())
    assert reach[0] == 10


def test_gaps_can_read_as_zero(cell: Cell, plan_of: Callable[..., ModbusPlan]) -> None:
    """Only between mapped addresses, and only for reading."""
    image = RegisterImage(plan_of(fill_gaps=True), cell)
    assert image.holding.readable.reach[18] == MAX_READ_REGISTERS
    assert image.holding.readable.reach[501] == 1
    assert image.holding.readable.reach[502] == 0
    assert image.discrete.readable.reach[35] == 6
    assert image.discrete.readable.reach[0] == 0
    assert image.holding.changes(18, bytes(2)) == Refusal(Reason.NO_SUCH_ADDRESS)


def test_shows_what_the_robot_tells(unit: Unit, show: Callable[..., None]) -> None:
    show(int_0=-2, int_1=7, real_0=1.5, bit_0=True, bit_17=True, swapped=1.5, clipped=1e9, fragile=9)
    holding, image = unit.image.holding.image, unit.image
    assert holding[200:208] == struct.pack(">ii", -2, 7)
    assert image.input.image[:8] == struct.pack(">ii", -2, 7)
    assert holding[400:408] == struct.pack(">d", 1.5)
    assert holding[1000:1004] == bytes.fromhex("0001 0002")
    assert image.discrete.read(3, 32) == bytes.fromhex("01 00 02 00")
    assert holding[602:606] == bytes.fromhex("0000 3fc0"), "words swapped"
    assert holding[606:608] == bytes.fromhex("7fff"), "saturated"
    assert holding[600:602] == bytes.fromhex("0009")


def test_what_the_robot_no_longer_tells_is_cleared_or_held_back(
    cell: Cell, unit: Unit, show: Callable[..., None]
) -> None:
    show(int_0=7, fragile=9)
    holding = unit.image.holding
    assert holding.readable.reach[300] == 4
    cell.robot_lost("cable", 1001.0)
    assert holding.image[200:204] == bytes(4)
    assert (holding.readable.reach[300], holding.readable.reach[301]) == (0, 3)
    assert unit.image.discrete.readable.reach[40] == 0
    assert holding.readable.mapped[300] == 4


def test_a_register_with_bits_of_both_directions_shows_both(
    cell: Cell, unit: Unit, show: Callable[..., None], index_of: IndexOf
) -> None:
    show(other_half=True)
    assert unit.image.holding.image[40:42] == bytes.fromhex("0002")
    assert cell.write(Requester(0), [Change(index_of("half"), value=True)], 1000.0) is None
    assert unit.image.holding.image[40:42] == bytes.fromhex("0003")
    show(other_half=False)
    assert unit.image.holding.image[40:42] == bytes.fromhex("0001")


def test_follows_its_cell_until_closed(cell: Cell, unit: Unit, show: Callable[..., None]) -> None:
    unit.close()
    unit.close()
    assert not cell.listeners
    show(int_0=7)
    assert unit.image.holding.image[200:204] == bytes(4)


def test_a_write_is_a_list_of_whole_variables(unit: Unit, index_of: IndexOf) -> None:
    data = struct.pack(">Hih", 5, -6, 75)
    assert unit.image.holding.changes(10, data) == [
        Change(index_of("part"), 5),
        Change(index_of("count"), -6),
        Change(index_of("force"), 7.5),
    ]


@pytest.mark.parametrize(
    "case",
    [
        (11, 1, Reason.PARTIAL_VALUE, "count"),
        (12, 1, Reason.PARTIAL_VALUE, "count"),
        (10, 2, Reason.PARTIAL_VALUE, "count"),
        (15, 2, Reason.PARTIAL_VALUE, "speed"),
        (17, 2, Reason.NO_SUCH_ADDRESS, None),
        (99, 2, Reason.NO_SUCH_ADDRESS, None),
        (100, 2, Reason.NOT_WRITABLE, "int_0"),
        (101, 1, Reason.NOT_WRITABLE, "int_0"),
        (500, 1, Reason.NOT_WRITABLE, "bit_0"),
        (65535, 2, Reason.NO_SUCH_ADDRESS, None),
    ],
)
def test_a_write_that_can_never_be_is_refused(
    unit: Unit, index_of: IndexOf, case: tuple[int, int, Reason, str | None]
) -> None:
    address, words, reason, variable = case
    expected = Refusal(reason, index_of(variable) if variable is not None else None)
    assert unit.image.holding.changes(address, bytes(2 * words)) == expected


def test_bits_of_a_written_register_are_implied(unit: Unit, index_of: IndexOf) -> None:
    assert unit.image.holding.changes(0, bytes.fromhex("8001")) == [
        Change(index_of("start"), value=True, implied=True),
        Change(index_of("stop"), value=False, implied=True),
        Change(index_of("mode"), value=True, implied=True),
    ]


def test_bits_selected_by_a_mask_are_meant(unit: Unit, index_of: IndexOf) -> None:
    assert unit.image.holding.masked(0, 0x7FFE, 0x8000) == [
        Change(index_of("start"), value=False),
        Change(index_of("mode"), value=True),
    ]


@pytest.mark.parametrize(
    "and_mask,or_mask", [(0x00F2, 0x0025), (0, 0xFFFF), (0xFFFF, 0x1234), (0x5555, 0xFFFF)]
)
def test_a_mask_on_a_number_follows_the_formula(
    cell: Cell, unit: Unit, index_of: IndexOf, and_mask: int, or_mask: int
) -> None:
    assert cell.write(Requester(0), [Change(index_of("part"), 0x0012)], 1000.0) is None
    expected = (0x0012 & and_mask) | (or_mask & ~and_mask & 0xFFFF)
    assert unit.image.holding.masked(10, and_mask, or_mask) == [Change(index_of("part"), expected)]


@pytest.mark.parametrize(
    "address,reason", [(1, Reason.NO_SUCH_ADDRESS), (11, Reason.PARTIAL_VALUE), (500, Reason.NOT_WRITABLE)]
)
def test_a_mask_that_can_never_be_is_refused(unit: Unit, address: int, reason: Reason) -> None:
    refusal = unit.image.holding.masked(address, 0, 0)
    assert isinstance(refusal, Refusal)
    assert refusal.reason is reason


def test_coils_are_written_one_by_one(unit: Unit, index_of: IndexOf) -> None:
    assert unit.image.coils.changes(8, [True, False]) == [
        Change(index_of("coil_8"), value=True),
        Change(index_of("coil_9"), value=False),
    ]
    assert unit.image.coils.changes(10, [True, False]) == Refusal(Reason.NO_SUCH_ADDRESS)


def test_an_input_is_shown_after_it_was_written(cell: Cell, unit: Unit, index_of: IndexOf) -> None:
    assert (
        cell.write(
            Requester(0), [Change(index_of("count"), -2), Change(index_of("coil_3"), value=True)], 1000.0
        )
        is None
    )
    assert unit.image.holding.image[22:26] == struct.pack(">i", -2)
    assert unit.image.coils.read(0, 10) == bytes.fromhex("08 00")


@pytest.mark.parametrize("direction", list(Direction))
def test_refreshing_what_did_not_change_changes_nothing(unit: Unit, direction: Direction) -> None:
    before = bytes(unit.image.holding.image)
    unit.image.refresh(direction)
    assert unit.image.holding.image == before
