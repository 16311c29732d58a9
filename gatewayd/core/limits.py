"""Whether a value may be written to a variable: the range of the robot's type, then the declared limits."""

from __future__ import annotations

import math
from typing import Final

from gatewayd.core.definition import Limits, Value, ValueKind, Variable

_NOTHING: Final = (math.inf, -math.inf)


def window(variable: Variable) -> tuple[float, float]:
    """Between which values `within` lets every value of the variable's kind pass as it is."""
    if variable.low is not None and variable.high is not None:
        return _NOTHING
    limits = variable.limits
    return (-math.inf, math.inf) if limits is None else (limits.low, limits.high)


def within(variable: Variable, value: Value) -> Value | None:
    """The value as it may be written, clamped where the mapping says so; None if it may not be.

    What the robot's type cannot hold is never clamped: 2**31 is no INT32, whatever the limits say, and neither is 1.5.
    NaN passes only where no limits are declared.
    """
    low, high = variable.low, variable.high
    if low is not None and high is not None:
        if not low <= value <= high or value != int(value):
            return None
        value = int(value)
    limits = variable.limits
    if limits is None or limits.low <= value <= limits.high:
        return value
    if not limits.clamp or math.isnan(value):
        return None
    return _clamp(limits, value, whole=variable.kind is ValueKind.INT)


def _clamp(limits: Limits, value: Value, *, whole: bool) -> Value | None:
    below = value < limits.low
    if not whole:
        return limits.low if below else limits.high
    bound = math.ceil(limits.low) if below else math.floor(limits.high)
    return bound if limits.low <= bound <= limits.high else None
