"""The process image: for every variable its value, the time its source told it, and its quality."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from enum import IntEnum

from gatewayd.core.definition import Direction, FallbackKind, Value, Variable

__all__ = ["ProcessImage", "Quality"]


class Quality(IntEnum):
    """How far a value can be trusted. The numbers stand in the status block: never renumber."""

    GOOD = 0
    STALE = 1
    """The robot has stopped telling, or cannot be reached."""
    UNAVAILABLE = 2
    """The controller does not have the field, or gave it to another client."""
    NEVER = 3
    """No value has come since the gateway started, or since the controller has the field."""
    FORCED = 4
    """The local operator put the value there (`gatewayd.core.forcing`)."""
    DIFFERS = 5
    """The robot holds something else than it was given."""
    OUT_OF_RANGE = 6
    """One of its places on a fieldbus cannot show the value."""
    NOT_RUNNING = 7
    """It is valid only while the robot program runs, and the program does not."""


class ProcessImage:
    """Values, times and qualities by variable index.

    The lists are public because links copy whole slices in and out of them; their lengths never change.
    All outputs come with one package, so they share `output_time`. An output that is not good shows its `on_stale`.
    """

    __slots__ = (
        "_exceptions",
        "_outputs_told",
        "available",
        "inputs",
        "output_time",
        "outputs",
        "quality",
        "times",
        "unreadable",
        "values",
        "variables",
    )

    def __init__(self, variables: Sequence[Variable]) -> None:
        self.variables = tuple(variables)
        self.inputs = _indices(variables, Direction.INPUT)
        self.outputs = _indices(variables, Direction.OUTPUT)
        self.values: list[Value] = [variable.kind.zero for variable in variables]
        self.times: list[float] = [-math.inf] * len(variables)
        """Time of the last write, fallback or adoption, for inputs; of the force, for forced outputs."""
        self.quality: list[Quality] = [Quality.NEVER] * len(variables)
        self.available = [True] * len(variables)
        """Whether the controller has the variable's field, and gave it to us if it is an input."""
        self.output_time = -math.inf
        """Time of the last package that was shown."""
        self._exceptions = frozenset(
            index for index in self.outputs if variables[index].on_stale.kind is FallbackKind.EXCEPTION
        )
        self.unreadable = self._exceptions
        """Outputs whose policy is `exception` and whose value is neither good nor forced now."""
        self._outputs_told = False
        for index in self.outputs:
            self._show_fallback(index)

    def time_of(self, index: int) -> float:
        """When the source told the value; minus infinity if it never did."""
        if self.variables[index].direction is Direction.INPUT or self.quality[index] is Quality.FORCED:
            return self.times[index]
        told = self.quality[index] in (Quality.GOOD, Quality.STALE)
        return self.output_time if told else -math.inf

    def age(self, index: int, now: float) -> float:
        """Seconds since the source told the value; infinity if it never did."""
        return now - self.time_of(index)

    def tell(self, index: int, value: Value, now: float) -> None:
        """Set an input: it was written, fell back, or was adopted."""
        self.tell_all(((index, value),), now)

    def tell_all(self, told: Iterable[tuple[int, Value]], now: float) -> None:
        """Set several inputs of one moment."""
        values, times, quality, available = self.values, self.times, self.quality, self.available
        good = Quality.GOOD
        for index, value in told:
            values[index] = value
            times[index] = now
            if available[index]:
                quality[index] = good

    def inputs_lost(self) -> None:
        """Nobody knows what the controller's inputs hold from now on."""
        self._doubt(self.inputs)

    def outputs_told(self, now: float) -> None:
        """The values of a package were copied into `values`."""
        self.output_time = now
        if self._outputs_told:
            return
        self._outputs_told = True
        for index in self.outputs:
            if self.available[index]:
                self.quality[index] = Quality.GOOD
        self.find_unreadable()

    def outputs_lost(self) -> None:
        """The robot has stopped telling: outputs show their fallbacks until `outputs_told`."""
        self._outputs_told = False
        for index in self.outputs:
            self._show_fallback(index)
        self._doubt(self.outputs)
        self.find_unreadable()

    def set_available(self, index: int, available: bool) -> None:
        """The controller gave or refused the field. What it gave is not good before it was told."""
        if available:
            self.quality[index] = Quality.NEVER if self.time_of(index) == -math.inf else Quality.STALE
        else:
            self.quality[index] = Quality.UNAVAILABLE
        self.available[index] = available
        if self.variables[index].direction is Direction.OUTPUT:
            self._outputs_told = False
            self._show_fallback(index)
            self.find_unreadable()

    def find_unreadable(self) -> None:
        """Bring `unreadable` up to date after qualities changed."""
        shown = (Quality.GOOD, Quality.FORCED)
        self.unreadable = frozenset(index for index in self._exceptions if self.quality[index] not in shown)

    def _doubt(self, variables: Iterable[int]) -> None:
        for index in variables:
            if self.quality[index] is Quality.GOOD:
                self.quality[index] = Quality.STALE

    def _show_fallback(self, index: int) -> None:
        variable = self.variables[index]
        self.values[index] = variable.on_stale.apply(self.values[index], variable.kind)


def _indices(variables: Sequence[Variable], direction: Direction) -> tuple[int, ...]:
    return tuple(index for index, variable in enumerate(variables) if variable.direction is direction)
