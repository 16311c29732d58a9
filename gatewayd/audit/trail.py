"""The write audit: who wrote what, when, old and new value, accepted or refused and why.

Every accepted write that changes something, every refusal, and whatever happens to locks, fallbacks and forces becomes
a record. A rewrite of an unchanged value is none: a PLC that writes its whole image at 100 Hz would bury the rest. Of
a value that one writer keeps changing, the first change is recorded at once, the others of the next `MERGED` seconds
together. Refusals are merged by the cell itself. What is too much all the same is merged (`audit.merging`).
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass

from gatewayd.audit.merging import AuditMerging
from gatewayd.audit.record import Record
from gatewayd.core.cell import Cell, Written
from gatewayd.core.definition import Value
from gatewayd.core.events import Event, EventKind
from gatewayd.core.history import History
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.report.event_text import ACCEPTED, EventRecord
from gatewayd.report.printable import json_text

CAPACITY = 2000
"""Last records kept in memory, of all cells together; of each kind older ones are kept beside them (`core.history`)."""
MERGED = 1.0
"""Seconds for which further changes of a variable by the same writer are counted before they are recorded."""
KINDS = frozenset(
    {
        EventKind.REFUSED,
        EventKind.ACQUIRED,
        EventKind.TAKEN_OVER,
        EventKind.RELEASED,
        EventKind.FALLBACK,
        EventKind.FOLLOWED,
        EventKind.FORCED,
        EventKind.UNFORCED,
    }
)
"""Events that are audited."""

_PERIOD = 0.2

log = logging.getLogger("gatewayd.audit")


class Audit:
    """The records of all cells, oldest first when iterated. `sink` gets each as a line of JSON and must not block."""

    def __init__(
        self,
        sink: Callable[[str], None] | None = None,
        capacity: int = CAPACITY,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        self._records = History[Record](capacity)
        self._merging = AuditMerging(self._keep)
        self._sink = sink
        self._wall_clock = wall_clock
        self._flooded: set[tuple[str, str]] = set()
        self._watches: dict[int, _Watch] = {}

    def watch(self, cell: Cell) -> None:
        """Record what is written to the cell from now on. Watching a cell twice is watching it once."""
        if id(cell) not in self._watches:
            self._watches[id(cell)] = _Watch(cell, self)

    def follow(self, cells: Iterable[Cell]) -> None:
        """Watch these cells and no others; what was merged of those, and is not recorded yet, is recorded."""
        present = {id(cell): cell for cell in cells}
        for gone in [known for known in self._watches if known not in present]:
            self._watches.pop(gone).end()
        for cell in present.values():
            self.watch(cell)

    def tick(self, now: float) -> None:
        """Record what was merged long enough. Cheap while nothing was."""
        for watch in self._watches.values():
            watch.tick(now)
        self._merging.tick(now)
        flooded = set(self._merging.flooded(now))
        for cell, writer in sorted(flooded - self._flooded):
            log.warning("the audit merges records, too many at once", extra=fields(cell=cell, writer=writer))
        self._flooded = flooded

    @property
    def troubles(self) -> list[str]:
        """For whose sake records are merged now."""
        found = sorted(self._flooded)
        return [f"{cell}: more audit records of {writer} than are kept one by one" for cell, writer in found]

    async def run(self, cells: Callable[[], Iterable[Cell]]) -> None:
        """Keep up with the gateway's cells until cancelled; then record what was merged and is not recorded yet."""
        try:
            while True:
                self.follow(cells())
                self.tick(clock.now())
                await asyncio.sleep(_PERIOD)
        finally:
            self.follow(())
            self._merging.tick(math.inf)

    def append(self, record: Record) -> None:
        """Keep the record, and give it to the sink; or merge it with others, if there are too many."""
        self._merging.add(record)

    def _keep(self, record: Record) -> None:
        self._records.append((record.cell, record.event.what), record.monotonic, record)
        if self._sink is not None:
            text = json.dumps(record.as_json(), ensure_ascii=False, separators=(",", ":"))
            self._sink(json_text(text))

    def wall(self, ago: float = 0.0) -> float:
        """The wall clock so many seconds ago."""
        return self._wall_clock() - ago

    def __iter__(self) -> Iterator[Record]:
        return iter(self._records)


@dataclass(slots=True)
class _Series:
    """Changes of one variable by one writer that are not recorded yet."""

    writer: int
    recorded: float
    """When it was recorded last."""
    old: Value
    new: Value
    last: float
    """When it was changed last."""
    pending: int


class _Watch:
    """One cell's writes and events, on their way to the audit."""

    def __init__(self, cell: Cell, audit: Audit) -> None:
        self.cell = cell
        self._audit = audit
        self._series: dict[int, _Series] = {}
        self._next = math.inf
        cell.write_listeners.append(self.written)
        cell.events.listeners.append(self.happened)

    def end(self) -> None:
        """Follow the cell no longer."""
        with suppress(ValueError):  # a cell that has a successor has no listeners any more
            self.cell.write_listeners.remove(self.written)
            self.cell.events.listeners.remove(self.happened)
        self.tick(math.inf)

    def written(self, writer: int, changes: Written, now: float) -> None:
        """A write was accepted: the hot path."""
        known, merged_since = self._series.get, now - MERGED
        for index, old, new in changes:
            current = known(index)
            if current is not None and current.writer == writer and current.recorded > merged_since:
                if not current.pending:
                    current.old = old
                    self._next = min(self._next, current.recorded + MERGED)
                current.new = new
                current.last = now
                current.pending += 1
                continue
            if current is not None:
                self._record(index, current, now)
            self._series[index] = current = _Series(writer, now, old, new, now, 1)
            self._record(index, current, now)
            self._next = min(self._next, now + MERGED)

    def tick(self, now: float) -> None:
        """Record what was merged for `MERGED` seconds, and forget what was not changed again."""
        if now < self._next:
            return
        for index, series in list(self._series.items()):
            if now - series.recorded < MERGED:
                continue
            if series.pending:
                self._record(index, series, now)
                series.recorded = now
            else:
                del self._series[index]
        self._next = min((series.recorded + MERGED for series in self._series.values()), default=math.inf)

    def happened(self, event: Event) -> None:
        """An event of the cell."""
        if event.kind not in KINDS:
            return
        definition = self.cell.definition
        if event.variable is not None and event.variable in self._series:
            # In their order: what was written before a fallback or a force is recorded before it.
            self._record(event.variable, self._series.pop(event.variable), event.time)
        record = EventRecord.of(event, definition)
        self._audit.append(Record(self._audit.wall(), event.time, definition.name, record))

    def _record(self, index: int, series: _Series, now: float) -> None:
        if not series.pending:
            return
        definition = self.cell.definition
        variable = definition.variables[index]
        record = EventRecord(
            ACCEPTED,
            definition.writer_name(series.writer),
            variable.name,
            variable.unit,
            old=series.old,
            new=series.new,
            times=series.pending,
        )
        wall = self._audit.wall(now - series.last if now < math.inf else 0.0)
        self._audit.append(Record(wall, series.last, definition.name, record))
        series.pending = 0
