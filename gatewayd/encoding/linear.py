"""What registers and objects have in common: value in the robot's unit = raw number * scale + offset."""

from __future__ import annotations

import math
from collections.abc import Callable

from gatewayd.core.definition import Value, ValueKind


def saturated(raw: float, low: int, high: int) -> int:
    """The integer nearest to a raw number, halves to even; what lies beyond `low` and `high` is these, NaN is 0."""
    if raw <= low:
        return low
    if raw >= high:
        return high
    return round(raw) if raw == raw else 0  # noqa: PLR0124 - NaN is what differs from itself


def whole(value: float) -> int | None:
    """The integer nearest to a value; None for infinities and NaN."""
    return round(value) if math.isfinite(value) else None


def meaning_of(kind: ValueKind, scale: float, offset: float) -> Callable[[float], Value | None]:
    """What raw numbers are as values of `kind`; integers of 64 bits keep every digit where nothing is scaled."""
    if kind is ValueKind.BOOL:
        return lambda raw: raw * scale + offset != 0
    if kind is ValueKind.FLOAT:
        return lambda raw: raw * scale + offset
    if scale == 1 and offset == 0:
        return whole
    return lambda raw: whole(raw * scale + offset)
