"""Whether a value may be written to a variable: the range of the robot's type, then the declared limits."""

from __future__ import annotations

import math

from gatewayd.core.definition import Value, ValueKind, Variable

__all__ = ["within"]


def within(variable: Variable, value: Value) -> Value | None:
    """The value as it may be written, clamped where the mapping says so; None if it may not be.

    What the robot's type cannot hold is never clamped: 2**31 is no INT32, whatever the limits say. NaN passes only
    where no limits are declared.
    """
    if variable.low is not None and variable.high is not None and not variable.low <= value <= variable.high:
        return None
    limits = variable.limits
    if limits is None or limits.low <= value <= limits.high:
        return value
    if not limits.clamp or math.isnan(value):
        return None
    bound = limits.low if value < limits.low else limits.high
    return int(bound) if variable.kind is ValueKind.INT else bound
