"""The process image: for every variable its value, the time when its source had it, and its quality.

Two declarations of a variable are compiled here, so that a package costs nothing more where they are not used: what
every place of it can show (`shown`, `shows_nan`), and that it means something only while the program runs.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from enum import IntEnum

from gatewayd.core.definition import Direction, FallbackKind, Value, Variable


class Quality(IntEnum):
    """How far a value can be trusted. The numbers stand in the status block: never renumber."""

    GOOD = 0
    STALE = 1
    """The robot has stopped reporting, or cannot be reached."""
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


_REPORTED = (Quality.GOOD, Quality.STALE, Quality.DIFFERS, Quality.OUT_OF_RANGE, Quality.NOT_RUNNING)
"""Qualities of values that came from their source at some time."""
_EVERY_NUMBER = (-sys.float_info.max, sys.float_info.max)
_SHOWN = (Quality.GOOD, Quality.OUT_OF_RANGE)
"""Qualities of outputs that show what the robot reports."""


class ProcessImage:
    """Values, times and qualities by variable index.

    The lists are public because links copy whole slices in and out of them; their lengths never change.
    All outputs that packages carry come with one, so they share `output_time`; others have a time each. An output that
    is stale, unavailable or not running shows its `on_stale`; one that is out of range shows its value as far as each
    place can.
    """

    def __init__(self, variables: Sequence[Variable]) -> None:
        self.variables = tuple(variables)
        self.inputs = _indices(variables, Direction.INPUT)
        self.outputs = _indices(variables, Direction.OUTPUT)
        self.packaged = tuple(index for index in self.outputs if not variables[index].via)
        """Outputs that the robot's packages carry."""
        self.values: list[Value] = [variable.kind.zero for variable in variables]
        self.times: list[float] = [-math.inf] * len(variables)
        """Time of the last write, fallback or adoption, for inputs; of the force, for forced outputs; of the last
        report, for outputs that a link of their own carries."""
        self.quality: list[Quality] = [Quality.NEVER] * len(variables)
        self.available = [True] * len(variables)
        """Whether the controller has the variable's field, and gave it to us if it is an input."""
        self.changes_of_availability = 0
        self.output_time = -math.inf
        """When what the outputs show was so in the robot: the last package that was shown came later by its lag."""
        self.running = False
        """Whether the robot program runs, as far as the controller says."""
        self.running_time = -math.inf
        """`output_time` of the last package that was shown while the program ran."""
        self._bounds = {
            index: (*(variable.shown or _EVERY_NUMBER), variable.shows_nan)
            for index, variable in enumerate(variables)
            if variable.shown is not None or not variable.shows_nan
        }
        """Range, and whether NaN and infinities are shown, of variables of which a place cannot show every value."""
        self._restricted = tuple(
            (index, *self._bounds[index]) for index in self.packaged if index in self._bounds
        )
        self._running_only = tuple(index for index in self.packaged if variables[index].valid_running)
        self._held: dict[int, Value] = {}
        """What outputs that are valid while the program runs, and hold their value otherwise, last were meanwhile."""
        self._stopped = False
        """Whether the outputs that are valid while the program runs were last shown while it did not."""
        self._covered: dict[int, Value] = {}
        """What the robot reports for outputs that show something else, because the program does not run."""
        self._exceptions = frozenset(
            index for index in self.outputs if variables[index].on_stale.kind is FallbackKind.EXCEPTION
        )
        self.unreadable = self._exceptions
        """Outputs whose policy is `exception` and whose value is neither good nor forced now."""
        self._outputs_stored = False
        for index in self.outputs:
            self._show_fallback(index)
        self._hold_shown()

    def time_of(self, index: int) -> float:
        """When the source had the value; minus infinity if it never did."""
        variable = self.variables[index]
        if variable.direction is Direction.INPUT or self.quality[index] is Quality.FORCED:
            return self.times[index]
        if self.quality[index] not in _REPORTED:
            return -math.inf
        if variable.via:
            return self.times[index]
        return self.running_time if variable.valid_running else self.output_time

    def age(self, index: int, now: float) -> float:
        """Seconds since the source had the value; infinity if it never did."""
        return now - self.time_of(index)

    def store(self, index: int, value: Value, now: float) -> None:
        """Set an input: it was written, fell back, or was adopted."""
        self.store_all(((index, value),), now)

    def store_all(self, changes: Iterable[tuple[int, Value]], now: float) -> None:
        """Set several inputs of one moment, or outputs that a link of their own carries."""
        values, times, quality, available = self.values, self.times, self.quality, self.available
        good, bounds = Quality.GOOD, self._bounds
        for index, value in changes:
            values[index] = value
            times[index] = now
            if available[index]:
                quality[index] = good if index not in bounds else self.judged(index)

    def inputs_lost(self) -> None:
        """Nobody knows what the controller's inputs hold from now on."""
        self._doubt(self.inputs)

    def uncover(self) -> None:
        """Put back what the robot reports, before a package is copied into `values`. Cheap while the program runs."""
        if self._covered:
            for index, value in self._covered.items():
                self.values[index] = value
            self._covered.clear()

    def outputs_stored(self, now: float) -> None:
        """The values of a package were copied into `values`, after `uncover`; they were so at `now`."""
        self.output_time = now
        if self.running:
            self.running_time = now
        changed = not self._outputs_stored
        if changed:
            self._outputs_stored = True
            for index in self.packaged:
                if self.available[index]:
                    self.quality[index] = Quality.GOOD
        if self._restricted:
            changed |= self._judge_outputs()
        if self._running_only:
            changed |= self._judge_running()
        if changed:
            self.find_unreadable()

    def outputs_lost(self) -> None:
        """The robot has stopped reporting: outputs show their fallbacks until `outputs_stored`."""
        self._outputs_stored = False
        self._covered.clear()
        self.unreported(self.packaged)

    def report(self, values: Iterable[tuple[int, Value]], now: float) -> None:
        """The link that carries these outputs knows what they are."""
        self.store_all(values, now)
        self.find_unreadable()

    def unreported(self, indices: Sequence[int]) -> None:
        """Nobody knows what these outputs are: they show their fallbacks."""
        for index in indices:
            self._show_fallback(index)
        self._doubt(indices)
        self.find_unreadable()

    def set_available(self, index: int, available: bool) -> None:
        """The controller gave or refused the field. What it gave is not good before it was stored."""
        if available:
            self.quality[index] = Quality.NEVER if self.time_of(index) == -math.inf else Quality.STALE
        else:
            self.quality[index] = Quality.UNAVAILABLE
        self.available[index] = available
        self.changes_of_availability += 1
        if self.variables[index].direction is Direction.OUTPUT:
            self._outputs_stored = False
            self._covered.pop(index, None)
            self._show_fallback(index)
            self.find_unreadable()

    def judged(self, index: int) -> Quality:
        """The quality of a value that is its source's and current: good, if every place can show it."""
        return _judged(self.values[index], *self._bounds[index]) if index in self._bounds else Quality.GOOD

    def bounds(self, index: int) -> tuple[float, float]:
        """Between which values a value that is its source's and current is good."""
        return self._bounds[index][:2] if index in self._bounds else _EVERY_NUMBER

    def succeed(self, former: ProcessImage, variables: Mapping[int, int]) -> None:
        """Go on where `former` stands, for variables that go on: old -> new index."""
        self.output_time, self.running_time = former.output_time, former.running_time
        self.running = former.running
        for source, target in variables.items():
            variable, quality = self.variables[target], former.quality[source]
            self.values[target] = former.values[source]
            self.times[target] = former.times[source]
            self.available[target] = former.available[source]
            is_output = variable.direction is Direction.OUTPUT
            if quality in _SHOWN:
                stopped = is_output and variable.valid_running and not self.running
                quality = Quality.NOT_RUNNING if stopped else self.judged(target)
            if is_output and quality not in _SHOWN:
                self.values[target] = variable.on_stale.apply(self.values[target], variable.kind)
            self.quality[target] = quality
        self._hold_shown()
        self.find_unreadable()

    def find_unreadable(self) -> None:
        """Bring `unreadable` up to date after qualities changed."""
        shown = (Quality.GOOD, Quality.FORCED)
        self.unreadable = frozenset(index for index in self._exceptions if self.quality[index] not in shown)

    def _hold_shown(self) -> None:
        """Outputs that hold their value while the program does not run hold what they show now."""
        for index in self._running_only:
            if self.variables[index].on_stale.kind is FallbackKind.HOLD:
                self._held[index] = self.values[index]

    def _judge_outputs(self) -> bool:
        """Find outputs that some place cannot show, after a package. Whether a quality changed."""
        values, quality, changed = self.values, self.quality, False
        good, out = Quality.GOOD, Quality.OUT_OF_RANGE
        for index, low, high, nan in self._restricted:
            value = values[index]
            if low <= value <= high:
                if quality[index] is out:
                    quality[index] = good
                    changed = True
            elif quality[index] is good or quality[index] is out:
                judged = _judged(value, low, high, nan)
                changed |= judged is not quality[index]
                quality[index] = judged
        return changed

    def _judge_running(self) -> bool:
        """Show what is valid only while the program runs, or its policy, after a package. Whether a quality changed."""
        values, quality, changed = self.values, self.quality, False
        if self.running:
            if self._stopped:
                self._stopped = False
                for index in self._running_only:
                    if quality[index] is Quality.NOT_RUNNING:
                        changed = True
                        quality[index] = self.judged(index)
            for index in self._held:
                self._held[index] = values[index]
            return changed
        self._stopped = True
        for index in self._running_only:
            if not self.available[index]:
                continue
            changed |= quality[index] is not Quality.NOT_RUNNING
            quality[index] = Quality.NOT_RUNNING
            self._covered[index] = values[index]
            variable = self.variables[index]
            values[index] = variable.on_stale.apply(self._held.get(index, values[index]), variable.kind)
        return changed

    def _doubt(self, variables: Iterable[int]) -> None:
        for index in variables:
            if self.quality[index] in _REPORTED:
                known = self.time_of(index) > -math.inf
                self.quality[index] = Quality.STALE if known else Quality.NEVER

    def _show_fallback(self, index: int) -> None:
        variable = self.variables[index]
        held = self._held.get(index, self.values[index])
        self.values[index] = variable.on_stale.apply(held, variable.kind)


def _judged(value: Value, low: float, high: float, nan: bool) -> Quality:
    """Good if every place can show it; `nan`: also NaN and the infinities, which have no place between the bounds."""
    fits = low <= value <= high or (nan and not math.isfinite(value))
    return Quality.GOOD if fits else Quality.OUT_OF_RANGE


def _indices(variables: Sequence[Variable], direction: Direction) -> tuple[int, ...]:
    return tuple(index for index, variable in enumerate(variables) if variable.direction is direction)
