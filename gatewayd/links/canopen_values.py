"""Raw numbers of CANopen objects and values of a cell's variables: what all kinds of links on CAN have in common.

value = raw * scale + offset, as in a register. A number that the type cannot hold becomes the nearest one that it can
(`fit`): integers saturate, halves round to even, NaN becomes 0 in an integer, a real beyond REAL32 becomes infinite.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache, partial
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Value, ValueKind, Variable
from gatewayd.encoding.limits import LimitReader, Meaning, ends_of, read_limits
from gatewayd.encoding.linear import meaning_of, saturated, whole
from gatewayd.mapping.reach import Reach, scaled

_MAX_REAL32: Final = float.fromhex("0x1.fffffep+127")


def fit(value: Value, can_type: CanType, linear: tuple[float, float] | None = None) -> Value:
    """The raw number of a value, or the nearest one that `can_type` can hold; see the module's docstring."""
    if linear is not None:
        value = (value - linear[1]) / linear[0]
    if can_type is CanType.BOOLEAN:
        return bool(value)
    if can_type.is_real:
        return _fit_real(value, can_type)
    return saturated(value, *can_type.bounds)


def _fit_real(value: Value, can_type: CanType) -> float:
    try:
        can_type.pack(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
    return float(value)


def native(raw: Value, kind: ValueKind) -> Value | None:
    """A received number as a value of a variable of `kind`; None if there is none (NaN or infinity as an integer)."""
    if kind is ValueKind.BOOL:
        return bool(raw)
    if kind is ValueKind.FLOAT:
        return float(raw)
    return whole(raw)


def meaning(kind: ValueKind, linear: tuple[float, float] | None) -> Meaning:
    """What received numbers are as values of a variable of `kind`."""
    return partial(native, kind=kind) if linear is None else meaning_of(kind, *linear)


def limits_of(
    declared: Variable, can_type: CanType, linear: tuple[float, float] | None = None
) -> LimitReader | None:
    """What reads received numbers, so that the one nearest to a limit is the limit; None where `meaning` does alone."""
    limits = (declared.limits.low, declared.limits.high) if declared.limits is not None else None
    ends = ends_of(declared.kind, limits, declared.low, declared.high)
    if can_type is CanType.BOOLEAN:
        return None
    return read_limits(ends, can_type.char, meaning(declared.kind, linear), *(linear or (1.0, 0.0)))


@lru_cache
def reach_of(can_type: CanType, linear: tuple[float, float] | None) -> Reach:
    """What an object can show, in the robot's unit."""
    if can_type is CanType.REAL64:
        return Reach(None, None, is_real=True)
    scale, offset = (Fraction(part) for part in linear or (1, 0))
    if can_type is CanType.REAL32:
        return scaled(-_MAX_REAL32, _MAX_REAL32, scale, offset, is_real=True)
    return scaled(*can_type.bounds, scale, offset, is_real=False)
