from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import ValueKind
from gatewayd.encoding.linear import meaning_of, saturated


@pytest.mark.parametrize(
    "raw, number",
    [
        (2.5, 2),
        (3.5, 4),
        (-128.4, -128),
        (-1e9, -128),
        (1e9, 127),
        (math.nan, 0),
        (math.inf, 127),
        (-math.inf, -128),
    ],
)
def test_an_integer_saturates_and_rounds_to_even(raw: float, number: int) -> None:
    assert saturated(raw, -128, 127) == number


@pytest.mark.parametrize(
    "kind, raw, value",
    [
        (ValueKind.FLOAT, 3, 35.0),
        (ValueKind.INT, 3.26, 38),
        (ValueKind.INT, math.inf, None),
        (ValueKind.BOOL, -0.5, False),
        (ValueKind.BOOL, 1, True),
    ],
)
def test_meaning(kind: ValueKind, raw: float, value: object) -> None:
    assert meaning_of(kind, 10.0, 5.0)(raw) == value


@given(st.integers(-(2**63), 2**64 - 1))
def test_integers_keep_every_digit(raw: int) -> None:
    assert meaning_of(ValueKind.INT, 1.0, 0.0)(raw) == raw
