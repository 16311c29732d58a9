"""The values of the self test; which variables are registers, tests/links/robot/urscript/test_registers.py shows."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import Direction, Limits, ValueKind, Variable
from gatewayd.links.robot_program import values_of


def variable(kind: ValueKind, **settings: Any) -> Variable:
    return Variable(1, "v", Direction.INPUT, kind, "input_int_register_0", **settings)


NUMBERS = st.floats(-1e12, 1e12)
RANGES = st.tuples(NUMBERS, NUMBERS).map(sorted)


@given(limits=RANGES)
def test_values_of_reals_are_within_limits_and_differ(limits: list[float]) -> None:
    found = values_of(variable(ValueKind.FLOAT, limits=Limits(limits[0], limits[1])))
    assert limits[0] <= found.low <= limits[1]
    assert limits[0] <= found.high <= limits[1]
    assert found.low != found.high or limits[0] == limits[1] or limits[1] - limits[0] < 1


@given(limits=st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(-(2**31), 2**31 - 1)).map(sorted))
def test_values_of_integers_are_within_limits_and_differ(limits: list[int]) -> None:
    found = values_of(
        variable(ValueKind.INT, low=-(2**31), high=2**31 - 1, limits=Limits(limits[0], limits[1]))
    )
    assert isinstance(found.low, int)
    assert isinstance(found.high, int)
    assert limits[0] <= found.low <= limits[1]
    assert limits[0] <= found.high <= limits[1]
    assert found.low != found.high or limits[0] == limits[1]


def test_a_wide_value_shows_a_wrong_word_or_byte_order() -> None:
    wide = values_of(variable(ValueKind.INT, low=-(2**31), high=2**31 - 1))
    assert int(wide.high).to_bytes(4) == bytes([1, 2, 3, 4])
    narrow = values_of(variable(ValueKind.INT, low=-(2**31), high=2**31 - 1, shown=(0, 65535)))
    assert int(narrow.high).to_bytes(2) == bytes([1, 2])
