"""What is measured while the status listener is configured: durations per hop, events by kind, lag of the loop.

The hops are seen from listeners of the cell and its source, so nothing is measured, and nothing costs, without it.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Iterable

from gatewayd.core.cell import Cell, Written
from gatewayd.core.definition import Direction
from gatewayd.core.events import Event, EventKind, EventRing
from gatewayd.core.refusal import Reason
from gatewayd.links.contract import SourceLink
from gatewayd.loop import clock
from gatewayd.report.verdict import CellVerdict, verdict_of
from gatewayd.service.daemon import Daemon
from gatewayd.service.liveness import Liveness
from gatewayd.web.health import readiness
from gatewayd.web.histogram import Histogram
from gatewayd.web.history import PERIOD, LastMinute

LAG_PERIOD = 0.1
"""Seconds between two looks at the loop's lag."""
_LOOKS_PER_ROUND = round(PERIOD / LAG_PERIOD)
"""Looks at the lag for each look at the daemon's cells and parts."""


class CellProbe:
    """Follows one cell, by its name, through reloads."""

    def __init__(self) -> None:
        self.package_to_image = Histogram()
        """From the arrival of a package's bytes to the moment when every fieldbus can be given its values."""
        self.write_to_package = Histogram()
        """From the arrival of a write to the package with it; the wait for the control cycle is part of it."""
        self.history = LastMinute()
        self.events: Counter[EventKind] = Counter()
        self.refusals: Counter[Reason] = Counter()
        """Equal ones are reported every `REFUSAL_INTERVAL` seconds, so these may lag behind `Health.writes_refused`."""
        self._image_time = 0.0
        self._written_at: float | None = None
        self._counted = 0
        self._cell: Cell | None = None
        self._link: SourceLink | None = None

    def attach(self, cell: Cell, link: SourceLink) -> None:
        """Follow this cell and link from now on. Events that the ring has and that were not counted yet are."""
        if cell is not self._cell:
            self._cell = cell
            self._written_at = None
            self._catch_up(cell.events)
            if self._event not in cell.events.listeners:
                cell.events.listeners.append(self._event)
            cell.listeners.append(self._changed)
            cell.write_listeners.append(self._written)
        if link is not self._link:
            self._link = link
            link.sent_listeners.append(self._sent)

    def _catch_up(self, ring: EventRing) -> None:
        """A ring that is younger than what was counted is a new one."""
        for _number, event in ring.since(self._counted if ring.count >= self._counted else 0):
            self._event(event)
        self._counted = ring.count

    def _event(self, event: Event) -> None:
        self._counted += 1
        self.events[event.kind] += 1 + event.repeats
        if isinstance(event.reason, Reason):
            self.refusals[event.reason] += 1 + event.repeats
        if event.kind is EventKind.ROBOT_LOST:
            self._written_at = None

    def _changed(self, direction: Direction) -> None:
        """The last listener of the cell: all images have the package by now."""
        assert self._cell is not None
        arrived = self._cell.freshness.last_arrival
        if direction is Direction.OUTPUT and arrived != self._image_time:
            self._image_time = arrived
            self.package_to_image.observe(clock.now() - arrived)

    def _written(self, _writer: int, _changes: Written, now: float) -> None:
        if self._written_at is None:
            self._written_at = now

    def _sent(self) -> None:
        if self._written_at is not None:
            self.write_to_package.observe(clock.now() - self._written_at)
            self._written_at = None


class Probes:
    """Measures `daemon` while `run` runs. `notes` are standing troubles that no link reports.

    `remarks` are such troubles, too, but with them every cell may be served.
    """

    def __init__(
        self,
        daemon: Daemon,
        notes: Callable[[], Iterable[str]] = lambda: (),
        remarks: Callable[[], Iterable[str]] = lambda: (),
    ) -> None:
        self.daemon = daemon
        self._notes = notes
        self._remarks = remarks
        self.lag = Histogram()
        """By how much the event loop came late."""
        self.late: tuple[str, ...] = ()
        """Parts of the gateway that hang."""
        self._cells: dict[str, CellProbe] = {}
        self._liveness = Liveness()

    def of(self, cell: Cell) -> CellProbe:
        """The probe of a cell that is served."""
        return self._cells.setdefault(cell.definition.name, CellProbe())

    def troubles(self) -> list[str]:
        """What concerns the gateway as a whole."""
        return [*self._notes(), *self.daemon.troubles(), *self._remarks()]

    def readiness(self, now: float) -> tuple[bool, dict[str, object]]:
        """Whether every cell is served, with the reasons."""
        return readiness(
            self.verdicts(now), self.late, [*self._notes(), *self.daemon.troubles()], self._remarks()
        )

    def verdicts(self, now: float) -> dict[str, CellVerdict]:
        """How each cell is, by name."""
        return {runtime.cell.definition.name: verdict_of(runtime, now) for runtime in self.daemon.runtimes}

    async def run(self) -> None:
        """Measure until cancelled."""
        while True:
            self.look(clock.now())
            for _ in range(_LOOKS_PER_ROUND):
                due = clock.now() + LAG_PERIOD
                await asyncio.sleep(LAG_PERIOD)
                self.lag.observe(clock.now() - due)

    def look(self, now: float) -> None:
        """Find the cells that are served now and the parts that hang."""
        self.late = self._liveness.late(self.daemon.progress(), now)
        for runtime in self.daemon.runtimes:
            probe = self.of(runtime.cell)
            probe.attach(runtime.cell, runtime.source)
            probe.history.look(runtime.cell, now)
        served = {cell.definition.name for cell in self.daemon.cells}
        for name in self._cells.keys() - served:
            del self._cells[name]
