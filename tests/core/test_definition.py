from __future__ import annotations

import pytest

from gatewayd.core.definition import Fallback, FallbackKind, Value, ValueKind


@pytest.mark.parametrize("kind, zero", [(ValueKind.BOOL, False), (ValueKind.INT, 0), (ValueKind.FLOAT, 0.0)])
def test_clear_gives_the_zero_of_the_kind_and_no_other_type(kind: ValueKind, zero: Value) -> None:
    cleared = Fallback().apply(1, kind)
    assert cleared == zero
    assert type(cleared) is type(zero)


@pytest.mark.parametrize("kind", [FallbackKind.HOLD, FallbackKind.EXCEPTION])
def test_hold_and_exception_keep_the_value(kind: FallbackKind) -> None:
    assert Fallback(kind).apply(3, ValueKind.INT) == 3


@pytest.mark.parametrize("value", [False, 0, 0.0, 7])
def test_a_declared_value_is_given_even_if_it_is_zero(value: Value) -> None:
    assert Fallback(FallbackKind.VALUE, value).apply(3, ValueKind.INT) == value
