"""The process image: for every variable its value, the time its source told it, and its quality."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum

from gatewayd.core.definition import Direction, Value, Variable

__all__ = ["ProcessImage", "Quality"]


class Quality(IntEnum):
    """How far a value can be trusted. The numbers stand in the status block: never renumber."""

    GOOD = 0
    STALE = 1
    """The robot has stopped telling, or cannot be reached."""
    UNAVAILABLE = 2
    """The controller does not have the field, or gave it to another client."""
    NEVER = 3
    """No value has come since the gateway started."""


class ProcessImage:
    """Values, times and qualities by variable index.

    The lists are public because links copy whole slices in and out of them; their lengths never change.
    All outputs come with one package, so they share `output_time`.
    """

    __slots__ = ("output_time", "quality", "times", "values", "variables")

    def __init__(self, variables: Sequence[Variable]) -> None:
        self.variables = tuple(variables)
        self.values: list[Value] = [
            variable.on_stale.apply(variable.kind.zero, variable.kind)
            if variable.direction is Direction.OUTPUT
            else variable.kind.zero
            for variable in variables
        ]
        self.times: list[float] = [-math.inf] * len(variables)
        """Time of the last accepted write or adoption, for inputs."""
        self.quality: list[Quality] = [Quality.NEVER] * len(variables)
        self.output_time = -math.inf
        """Time of the last package that was shown."""

    def time_of(self, index: int) -> float:
        """When the source told the value; minus infinity if it never did."""
        if self.variables[index].direction is Direction.INPUT:
            return self.times[index]
        return -math.inf if self.quality[index] is Quality.UNAVAILABLE else self.output_time

    def age(self, index: int, now: float) -> float:
        """Seconds since the source told the value; infinity if it never did."""
        return now - self.time_of(index)
