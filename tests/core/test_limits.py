from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import Direction, Limits, Value, ValueKind, Variable
from gatewayd.core.limits import window, within

LOW, HIGH = -(2.0**31), 2.0**31 - 1


def integer(limits: Limits | None = None) -> Variable:
    return Variable(1, "n", Direction.INPUT, ValueKind.INT, "f", low=LOW, high=HIGH, limits=limits)


def real(limits: Limits | None = None) -> Variable:
    return Variable(1, "x", Direction.INPUT, ValueKind.FLOAT, "f", limits=limits)


@pytest.mark.parametrize("value", [-(2**31), 0, 2**31 - 1])
def test_what_the_type_holds_passes(value: int) -> None:
    assert within(integer(), value) == value


@pytest.mark.parametrize("value", [-(2**31) - 1, 2**31, 2**64, 1.5, math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("limits", [None, Limits(0, 10, clamp=True)])
def test_what_the_type_cannot_hold_is_refused_never_clamped(value: Value, limits: Limits | None) -> None:
    assert within(integer(limits), value) is None


@pytest.mark.parametrize("value", [True, 1, 1.0])
def test_an_integer_is_stored_as_one_whatever_came(value: Value) -> None:
    stored = within(integer(), value)
    assert stored == 1
    assert type(stored) is int


@pytest.mark.parametrize("value", [0.0, 0.5, 1.0])
def test_limits_belong_to_the_range(value: float) -> None:
    assert within(real(Limits(0.0, 1.0)), value) == value


@pytest.mark.parametrize("value", [-5e-324, math.nextafter(1.0, 2), math.inf, math.nan])
def test_outside_the_limits_is_refused(value: float) -> None:
    assert within(real(Limits(0.0, 1.0)), value) is None


@pytest.mark.parametrize("value, clamped", [(-3.0, 0.0), (math.inf, 1.0), (-math.inf, 0.0), (0.5, 0.5)])
def test_a_clamp_moves_to_the_nearer_limit(value: float, clamped: float) -> None:
    assert within(real(Limits(0.0, 1.0, clamp=True)), value) == clamped


def test_a_nan_is_never_clamped_and_passes_without_limits() -> None:
    assert within(real(Limits(0.0, 1.0, clamp=True)), math.nan) is None
    passed = within(real(), math.nan)
    assert passed is not None
    assert math.isnan(passed)


@pytest.mark.parametrize("limits", [Limits(0.5, 10.7, clamp=True), Limits(-10.7, -0.5, clamp=True)])
@given(value=st.integers(-100, 100))
def test_a_clamped_integer_lies_within_limits_that_are_none(limits: Limits, value: int) -> None:
    clamped = within(integer(limits), value)
    assert type(clamped) is int
    assert limits.low <= clamped <= limits.high


def test_limits_without_an_integer_between_them_refuse_all() -> None:
    nothing = integer(Limits(0.2, 0.8, clamp=True))
    assert within(nothing, 0) is None
    assert within(nothing, 1) is None


@given(
    st.sampled_from(
        [integer(), real(), integer(Limits(0, 10)), real(Limits(0, 10)), real(Limits(0, 10, clamp=True))]
    ),
    st.floats() | st.integers(-20, 20),
)
def test_what_lies_in_the_window_passes_as_it_is(variable: Variable, value: Value) -> None:
    """So that the usual write need not ask."""
    low, high = window(variable)
    if low <= value <= high:
        assert within(variable, value) is value
