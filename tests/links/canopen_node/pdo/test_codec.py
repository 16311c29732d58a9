"""The compiled content of a PDO against a naive model that goes bit by bit."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.admission import Change
from gatewayd.core.definition import Direction, Limits, Value, ValueKind, Variable
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.links.canopen_node.pdo.codec import Layout, Mapped, is_aligned
from gatewayd.links.canopen_values import fit, native

NUMBERS = [one for one in CanType if one.bits > 1]
INTEGERS = [one for one in NUMBERS if not one.is_real]
OF_KIND = {
    ValueKind.BOOL: st.booleans(),
    ValueKind.INT: st.integers(-(2**63), 2**64 - 1),
    ValueKind.FLOAT: st.floats(),
}


def variable(index: int, kind: ValueKind) -> Variable:
    return Variable(index + 1, f"v{index}", Direction.OUTPUT, kind, "field")


@st.composite
def mappings(draw: st.DrawFn) -> tuple[list[Mapped], list[Variable], list[Value]]:
    """Any aligned mapping of at most 64 bits, over variables in any order, and values of these variables."""
    types: list[CanType | None] = []
    bits = 0
    while bits < 64 and draw(st.integers(0, 9)):
        wanted = draw(st.sampled_from([CanType.BOOLEAN, *NUMBERS]))
        if wanted.bits > 64 - bits:
            continue
        run = [wanted]
        if wanted is CanType.BOOLEAN:
            run *= draw(st.sampled_from([8, 16, 3, 64]))
            run = run[: 64 - bits]
        types += run
        bits += sum(one.bits for one in run)
        if bits % 8:
            break
    dummies = [one is not CanType.BOOLEAN and draw(st.integers(0, 4)) == 0 for one in types]
    count = len(types)
    order = draw(st.one_of(st.just(list(range(count))), st.permutations(range(count))))
    kinds = [draw(st.sampled_from(list(ValueKind))) for _ in types]
    variables = [variable(index, kind) for index, kind in enumerate(kinds)]
    values = [draw(OF_KIND[kind]) for kind in kinds]
    mapping = [
        Mapped(None if dummy else index, one)
        for index, one, dummy in zip(order, types, dummies, strict=True)
        if one is not None
    ]
    return mapping, variables, values


def naive_pack(mapping: Sequence[Mapped], values: Sequence[Value]) -> bytes:
    bits: list[int] = []
    for one in mapping:
        value = fit(values[one.variable], one.type) if one.variable is not None else 0
        number = int.from_bytes(one.type.pack(value), "little")
        bits += [number >> position & 1 for position in range(one.type.bits)]
    word = sum(bit << position for position, bit in enumerate(bits))
    return word.to_bytes((len(bits) + 7) // 8, "little")


def naive_unpack(mapping: Sequence[Mapped], data: bytes) -> list[tuple[int, Value]]:
    word = int.from_bytes(data, "little")
    found: list[tuple[int, Value]] = []
    for one in mapping:
        raw = word & (1 << one.type.bits) - 1
        word >>= one.type.bits
        if one.variable is not None:
            found.append((one.variable, one.type.unpack(raw.to_bytes((one.type.bits + 7) // 8, "little"))))
    return found


def same(one: Value, other: Value) -> bool:
    return type(one) is type(other) and struct.pack("<d", one) == struct.pack("<d", other)


@given(mappings())
def test_packs_what_a_bitwise_model_packs(case: tuple[list[Mapped], list[Variable], list[Value]]) -> None:
    mapping, variables, values = case
    layout = Layout(mapping, variables)
    assert layout.pack(layout.gather(values)) == naive_pack(mapping, values)
    assert layout.size == len(naive_pack(mapping, values))


@given(mappings(), st.binary(min_size=8, max_size=8))
def test_changes_are_what_a_bitwise_model_reads(
    case: tuple[list[Mapped], list[Variable], list[Value]], data: bytes
) -> None:
    mapping, variables, _values = case
    layout = Layout(mapping, variables)
    expected = [
        (index, native(raw, variables[index].kind))
        for index, raw in naive_unpack(mapping, data[: layout.size])
    ]
    changes = layout.changes(data[: layout.size])
    if isinstance(changes, Refusal):
        assert changes == Refusal(Reason.OUT_OF_LIMITS, next(i for i, value in expected if value is None))
        return
    assert [change.variable for change in changes] == [index for index, _value in expected]
    for change, (_index, value) in zip(changes, expected, strict=True):
        assert value is not None
        assert same(change.value, value) or (math.isnan(change.value) and math.isnan(value))


@given(mappings())
def test_what_fits_comes_back(case: tuple[list[Mapped], list[Variable], list[Value]]) -> None:
    """A second trip over the bus changes nothing any more."""
    mapping, variables, values = case
    layout = Layout(mapping, variables)
    data = layout.pack(layout.gather(values))
    changes = layout.changes(data)
    if isinstance(changes, Refusal):
        return
    arrived = list(values)
    for change in changes:
        arrived[change.variable] = change.value
    again = layout.pack(layout.gather(arrived))
    if not any(isinstance(change.value, float) and math.isnan(change.value) for change in changes):
        assert again == data


@given(st.integers(1, 1000).map(lambda cents: cents / 100))
def test_a_real32_that_is_nearest_to_a_limit_is_the_limit(limit: float) -> None:
    limited = replace(variable(0, ValueKind.FLOAT), limits=Limits(-limit, limit))
    layout = Layout([Mapped(0, CanType.REAL32)], [limited])
    for value in (limit, -limit):
        assert layout.changes(struct.pack("<f", value)) == [Change(0, value)]
    assert layout.changes(struct.pack("<f", math.inf)) == [Change(0, math.inf)]


def test_a_variable_that_is_twice_in_a_pdo_has_one_value() -> None:
    layout = Layout([Mapped(0, CanType.REAL32), Mapped(0, CanType.REAL32)], [variable(0, ValueKind.FLOAT)])
    assert layout.changes(struct.pack("<ff", 1.0, 1.0)) == [Change(0, 1.0), Change(0, 1.0)]
    assert layout.changes(struct.pack("<ff", 1.0, 2.0)) == Refusal(Reason.CONTRADICTED, 0)


def test_64_bits_are_one_integer_least_significant_first() -> None:
    variables = [variable(index, ValueKind.BOOL) for index in range(64)]
    layout = Layout([Mapped(index, CanType.BOOLEAN) for index in range(64)], variables)
    values: list[Value] = [index in (0, 9, 63) for index in range(64)]
    assert layout.pack(layout.gather(values)).hex() == "0102000000000080"
    changes = layout.changes(bytes.fromhex("0102000000000080"))
    assert isinstance(changes, list)
    assert [change.variable for change in changes if change.value] == [0, 9, 63]


def test_boolean_run_that_fills_its_bytes_may_precede_a_number() -> None:
    variables = [variable(index, ValueKind.BOOL) for index in range(8)] + [variable(8, ValueKind.INT)]
    mapping = [Mapped(index, CanType.BOOLEAN) for index in range(8)] + [Mapped(8, CanType.INTEGER32)]
    layout = Layout(mapping, variables)
    values: list[Value] = [True] + [False] * 7 + [-2]
    assert layout.pack(layout.gather(values)).hex() == "01feffffff"


def test_dummy_is_zero_when_sent_and_skipped_when_received() -> None:
    layout = Layout(
        [Mapped(None, CanType.UNSIGNED16), Mapped(0, CanType.UNSIGNED8)], [variable(0, ValueKind.INT)]
    )
    assert layout.pack([7]).hex() == "000007"
    assert layout.changes(bytes.fromhex("ffff07")) == [Change(0, 7)]


def test_every_bit_of_a_pdo_is_meant() -> None:
    variables = [variable(0, ValueKind.BOOL), variable(1, ValueKind.BOOL)]
    both = Layout([Mapped(0, CanType.BOOLEAN), Mapped(1, CanType.BOOLEAN)], variables)
    assert both.changes(b"\x02") == [Change(0, False), Change(1, True)]


def test_nan_stays_nan_in_a_real() -> None:
    layout = Layout([Mapped(0, CanType.REAL32)], [variable(0, ValueKind.FLOAT)])
    assert math.isnan(struct.unpack("<f", layout.pack([math.nan]))[0])


def test_nan_is_no_integer() -> None:
    layout = Layout([Mapped(0, CanType.REAL32)], [variable(0, ValueKind.INT)])
    assert layout.changes(struct.pack("<f", math.nan)) == Refusal(Reason.OUT_OF_LIMITS, 0)
    assert layout.changes(struct.pack("<f", 3.0)) == [Change(0, 3)]


def test_only_booleans_may_lie_off_a_byte_boundary() -> None:
    bits = [CanType.BOOLEAN]
    assert is_aligned([*bits * 8, CanType.INTEGER8, *bits * 3])
    assert not is_aligned([*bits * 3, CanType.INTEGER8])


def test_gathers_neighbours_and_others_alike() -> None:
    variables = [variable(index, ValueKind.INT) for index in range(4)]
    for order in ([0, 1, 2], [2, 0, 3], [3], [1, 1], []):
        layout = Layout([Mapped(index, CanType.INTEGER8) for index in order], variables)
        assert list(layout.gather([10, 11, 12, 13])) == [10 + index for index in order]
        assert layout.pack(layout.gather([10, 11, 12, 13])) == bytes(10 + index for index in order)


def _scaled(kind: ValueKind, linear: tuple[float, float], limits: Limits | None = None) -> Layout:
    variable = Variable(1, "speed", Direction.INPUT, kind, "input_double_register_0", limits=limits)
    plain = Variable(2, "count", Direction.INPUT, ValueKind.INT, "input_int_register_0")
    mapping = [Mapped(0, CanType.INTEGER16, linear=linear), Mapped(1, CanType.INTEGER16)]
    return Layout(mapping, [variable, plain])


def test_a_scaled_value_goes_as_its_raw_number() -> None:
    layout = _scaled(ValueKind.FLOAT, (0.1, 5.0))
    assert layout.pack((7.5, 3)) == struct.pack("<hh", 25, 3)
    changes = layout.changes(struct.pack("<hh", 25, 3))
    assert changes == [Change(0, 7.5), Change(1, 3)]


@pytest.mark.parametrize("value, raw", [(1e6, 32767), (-1e6, -32768), (math.nan, 0), (5.24, 2), (5.25, 2)])
def test_a_scaled_value_saturates_and_rounds(value: float, raw: int) -> None:
    assert _scaled(ValueKind.FLOAT, (0.1, 5.0)).pack((value, 0)) == struct.pack("<hh", raw, 0)


def test_the_raw_number_nearest_to_a_limit_is_the_limit() -> None:
    layout = _scaled(ValueKind.FLOAT, (0.1, 0.0), Limits(-0.3, 0.3))
    assert layout.changes(struct.pack("<hh", 3, 0)) == [Change(0, 0.3), Change(1, 0)]
    assert layout.changes(struct.pack("<hh", -3, 0)) == [Change(0, -0.3), Change(1, 0)]


def test_whole_numbers_are_scaled_too() -> None:
    layout = _scaled(ValueKind.INT, (10.0, 0.0))
    assert layout.pack((120, 0)) == struct.pack("<hh", 12, 0)
    assert layout.changes(struct.pack("<hh", 12, 0)) == [Change(0, 120), Change(1, 0)]
