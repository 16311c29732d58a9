"""Raw numbers of CANopen objects and values of variables. How PDOs use them is in tests/links/canopen_node/pdo."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Value, ValueKind
from gatewayd.links.canopen_values import fit, native, reach_of

INTEGERS = [each for each in CanType if each.bits > 1 and not each.is_real]


@pytest.mark.parametrize(
    "value, can_type, expected",
    [
        (40000, CanType.INTEGER16, 32767),
        (-40000, CanType.INTEGER16, -32768),
        (-1, CanType.UNSIGNED32, 0),
        (math.inf, CanType.UNSIGNED8, 255),
        (-math.inf, CanType.INTEGER8, -128),
        (math.nan, CanType.INTEGER32, 0),
        (2.5, CanType.INTEGER8, 2),
        (3.5, CanType.INTEGER8, 4),
        (True, CanType.UNSIGNED8, 1),
        (2**64, CanType.UNSIGNED64, 2**64 - 1),
        (1e39, CanType.REAL32, math.inf),
        (-1e39, CanType.REAL32, -math.inf),
        (-math.inf, CanType.REAL32, -math.inf),
        (3, CanType.REAL64, 3.0),
        (7, CanType.BOOLEAN, True),
        (0.0, CanType.BOOLEAN, False),
    ],
)
def test_value_beyond_its_type_becomes_the_nearest(value: Value, can_type: CanType, expected: Value) -> None:
    fitted = fit(value, can_type)
    assert fitted == expected
    assert type(fitted) is type(expected)


@given(st.integers() | st.floats(), st.sampled_from(INTEGERS))
def test_fitted_integers_can_always_be_packed(value: Value, can_type: CanType) -> None:
    can_type.pack(fit(value, can_type))


def test_nan_is_no_integer() -> None:
    assert native(math.nan, ValueKind.INT) is None
    assert native(2.6, ValueKind.INT) == 3


def test_reach_of_a_scaled_number_ends_half_a_step_beyond_it() -> None:
    reach = reach_of(CanType.INTEGER8, (0.5, 10))
    assert (reach.low, reach.high) == (Fraction(-217, 4), Fraction(295, 4))
    assert reach_of(CanType.REAL64, None).low is None
    assert reach_of(CanType.REAL32, None).is_real
