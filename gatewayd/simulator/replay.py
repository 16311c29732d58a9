"""A recording as the robot: its outputs come from a file, package by package, with the timing of their timestamps.

It begins with the first client that starts, so that nobody misses the beginning. Each row is shown for one control
cycle; where packages were lost when it was recorded, none is sent. Inputs and claims are those of any controller: a
recorded input shows what was recorded until a client claims it. While the timestamp is frozen the row is shown that was
shown last, and the recording goes on behind it afterwards. In a loop timestamps go on where the last round ended.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from itertools import islice, pairwise
from pathlib import Path
from statistics import median

from gatewayd.rtde.fields import INPUTS, Field
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.recording import RecordingError, RecordingReader, open_recording
from gatewayd.simulator.controller import CREEP
from gatewayd.simulator.server import SimulatedController

MAX_RATE = 1000.0
"""Cycles per second at most."""

_LOOKED_AT = 500  # rows from which the rate is taken
_log = logging.getLogger(__name__)
_Row = tuple[Scalar, ...]


class RecordedRobot:
    """What a recording says about the robot. RecordingError if it cannot be read or has no package."""

    def __init__(self, path: str | Path) -> None:
        self.path = str(path)
        with open_recording(path) as reader:
            self.recipe = reader.recipe
            """What a row consists of."""
            rows = list(islice(reader, _LOOKED_AT))
        place = self.recipe.slots.get("timestamp")
        self.clock = None if place is None else place.start
        """Where the timestamp lies in a row; None: rows follow each other at the rate."""
        if not rows:
            raise RecordingError(f"{path}: has no package to replay")
        self.rate = self._rate(rows)
        """Packages per second by their timestamps; None if they do not say."""

    @property
    def fields(self) -> tuple[Field, ...]:
        """The outputs as a controller of its own has them: inputs, which every controller has, and time excluded."""
        kinds = self.recipe.kinds.items()
        return tuple(
            Field(name, kind, "recorded")
            for name, kind in kinds
            if name not in INPUTS and name not in ("timestamp", "control_step")
        )

    def _rate(self, rows: list[_Row]) -> float | None:
        if self.clock is None:
            return None
        times = [float(row[self.clock]) for row in rows]
        steps = [b - a for a, b in pairwise(times) if 0 < b - a < math.inf]
        if not steps:
            return None
        rate = 1 / median(steps)
        return min(max(float(round(rate)) if rate > 1 else 1.0, 1.0), MAX_RATE)


class Replay:
    """Drives one simulator by a recording. `repeat`: again and again; else the simulator has `ended` at the last row.

    Its controller is one for the recording: `replayed`, with the recorded `fields`.
    """

    def __init__(
        self, simulator: SimulatedController, recorded: RecordedRobot, *, repeat: bool = False
    ) -> None:
        self.problem: str | None = None
        """Why it has ended before the end of the file."""
        self.rows = 0
        """Rows that were shown."""
        self._simulator = simulator
        self._controller = simulator.controller
        self._recorded = recorded
        self._repeat = repeat
        recipe, store = recorded.recipe, simulator.controller.store
        self._places = [
            (name, recipe.slots[name], store.place(name)) for name in recipe.names if name in store
        ]
        self._own = [name for name in recipe.names if name in INPUTS]
        self._clock_place = store.place("timestamp").start if recorded.clock is not None else None
        self._counter = recipe.slots["control_step"].start if "control_step" in recipe.slots else None
        self._reader: RecordingReader | None = None
        self._rows: Iterator[_Row] = iter(())
        self._next: _Row | None = None

    def begin(self) -> None:
        """Wait for the first client, and begin with the first row."""
        self.close()
        self._reader = open_recording(self._recorded.path)
        self._waiting = True
        self._over = False
        self._shift = 0.0
        self._begin_round()
        self._due = 0
        self._frozen = 0
        self._followed = self._controller.cycle
        self._anchor = (0, math.nan)
        self._next = self._read()
        self._controller.quiet = True
        if self._next is not None:
            self._show(self._next)

    def follow(self, cycle: int) -> None:
        """Show the row that is due in this cycle; the newest of those that are late."""
        if self._over or (self._waiting and not self._simulator.streaming):
            self._controller.quiet = True
            return
        passed, self._followed = cycle - self._followed, cycle
        if self._stands_still():
            self._frozen += passed
            self._controller.quiet = False
            return
        cycle -= self._frozen
        if self._waiting:
            self._waiting = False
            self._due = cycle
            self._anchor = (cycle, self._time(self._next))
        shown = None
        while self._next is not None and self._due <= cycle:
            shown = self._next
            self._advance()
        self._controller.quiet = shown is None
        if shown is not None:
            self._show(shown)
            self.rows += 1
        elif self._next is None:
            self._end()

    def _stands_still(self) -> bool:
        """Whether the same row is shown again and again; by `creep` its timestamp goes on a little."""
        faults, place = self._controller.faults, self._clock_place
        if faults.creep and place is not None:
            self._controller.store.cells[place] = float(self._controller.store.cells[place]) + CREEP
            self._controller.store.edition += 1
        return faults.freeze or faults.creep

    async def settle(self) -> None:
        """Nothing takes longer than its cycle."""

    def close(self) -> None:
        """Close the file."""
        if self._reader is not None:
            self._reader.close()
            self._reader = None

    def _begin_round(self) -> None:
        self._rows = iter(()) if self._reader is None else iter(self._reader)
        self._first = math.nan
        self._last = math.nan

    def _read(self) -> _Row | None:
        """The next row, its timestamp and step counter moved on by the rounds before; None at the end."""
        row = self._row()
        if row is None and self._repeat and self.problem is None:
            if not math.isnan(self._last):
                self._shift += self._last - self._first + 1 / self._controller.rate
            self._begin_round()
            row = self._row()
        return None if row is None else self._moved(row)

    def _row(self) -> _Row | None:
        try:
            row = next(self._rows, None)
        except RecordingError as error:
            self.problem = str(error)
            _log.error("%s", error)
            return None
        clock = self._recorded.clock
        if row is not None and clock is not None and math.isfinite(time := float(row[clock])):
            self._first = time if math.isnan(self._first) else self._first
            self._last = time
        return row

    def _moved(self, row: _Row) -> _Row:
        clock, counter = self._recorded.clock, self._counter
        if not self._shift or clock is None:
            return row
        values = list(row)
        values[clock] = float(values[clock]) + self._shift
        if counter is not None:
            values[counter] = int(values[counter]) + round(self._shift * self._controller.rate)
        return tuple(values)

    def _advance(self) -> None:
        """Take the next row, and say in which cycle it is due: never in that of the row before."""
        self._next = self._read()
        before, (cycle, time) = self._due, self._anchor
        now = self._time(self._next)
        elapsed = (now - time) * self._controller.rate
        if not elapsed > 0:  # no time, or the controller was started anew while this was recorded
            self._due = before + 1
            self._anchor = (self._due, now)
            return
        self._due = max(before + 1, cycle + round(elapsed))

    def _time(self, row: _Row | None) -> float:
        clock = self._recorded.clock
        time = math.nan if row is None or clock is None else float(row[clock])
        return time if math.isfinite(time) else math.nan

    def _show(self, row: _Row) -> None:
        claims, cells = self._controller.claims, self._controller.store.cells
        theirs = {name for name in self._own if claims.owner(name) is not None}
        for name, slot, place in self._places:
            if name not in theirs:
                cells[place] = row[slot]
        self._controller.store.edition += 1
        self._controller.enforce()

    def _end(self) -> None:
        self._over = True
        torn = "" if self._reader is None else self._reader.torn
        _log.info("%s is through%s", self._recorded.path, f"; {torn}" if torn else "")
        if self._simulator.ended is not None:
            self._simulator.ended()
