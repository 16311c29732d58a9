"""The audit under a flood: what is the same becomes one record, so that nobody writes over the evidence of others.

Records are the same if cell, deed, writer, address, variable, lock, reason and holder are. Of those some are kept one
by one; then all of a while are one, with their number, the `old` of the first and the `new` of the last. The same holds
for all that one writer does, and for all that is done: however many records come, few bytes leave.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import replace

from gatewayd.audit.record import Record
from gatewayd.core.requester import host_of
from gatewayd.loop.quota import Quota
from gatewayd.report.event_text import ACCEPTED, EventRecord

EACH, EACH_PERIOD = 30, 30.0
"""Equal records that are kept one by one, and seconds for each further one."""
OF_WRITER = 1000
"""Records of one writer, or of all undeclared peers, kept one by one; then ten a second."""
ALL = 5000
"""Records of all together kept one by one; then twenty a second."""
WAITING = 1000
"""Kinds of records of one writer that wait for their turn; of further ones only the number is kept."""
ALARM = 60.0
"""Seconds for which it is a trouble that a writer did more than is kept."""


_Source = tuple[str, str]
"""Cell and writer."""


class AuditMerging:
    """Gives `keep` the records that are kept, in their order as far as they are of one kind."""

    def __init__(self, keep: Callable[[Record], None]) -> None:
        self._keep = keep
        self._each = Quota(EACH, EACH_PERIOD)
        self._of_writer = Quota(OF_WRITER, 0.1)
        self._all = Quota(ALL, 0.05)
        self._waiting: dict[_Source, dict[Hashable, Record]] = {}
        self._flooded: dict[_Source, float] = {}
        """By whom more was done than is kept, and when last."""

    def add(self, record: Record) -> None:
        """Keep the record now, or later together with others."""
        source, subject = _source(record), _subject(record.event)
        waiting = self._waiting.get(source)
        if waiting is not None:
            if subject not in waiting and len(waiting) >= WAITING:
                subject, record = record.event.what, _only_counted(record)
            former = waiting.get(subject)
            if former is not None:
                waiting[subject] = _merged(former, record)
                return
        now = record.monotonic
        if not self._is_too_much(source, now) and self._each.has((source, subject), now):
            if record.event.what != ACCEPTED and record.event.variable is not None:
                self._keep_writes(record.cell, record.event.variable, now)
            self._keep_now(source, subject, record, now)
        else:
            self._waiting.setdefault(source, {})[subject] = record

    def tick(self, now: float) -> None:
        """Keep what waited long enough; infinity: everything."""
        for source, waiting in list(self._waiting.items()):
            for subject in list(waiting):
                if now < math.inf and self._is_too_much(source, now):
                    break
                if self._each.has((source, subject), now) or now == math.inf:
                    self._keep_now(source, subject, waiting.pop(subject), now)
            if not waiting:
                del self._waiting[source]

    def flooded(self, now: float) -> list[_Source]:
        """Who did so much within the last `ALARM` seconds that records were merged for its sake: cell and writer."""
        self._flooded = {source: at for source, at in self._flooded.items() if now - at < ALARM}
        return list(self._flooded)

    def _is_too_much(self, source: _Source, now: float) -> bool:
        if self._of_writer.has(source, now) and self._all.has(None, now):
            return False
        self._flooded[source] = now
        return True

    def _keep_writes(self, cell: str, variable: str, now: float) -> None:
        """In their order: what was written to a variable stands before what became of it then."""
        subject = _subject(EventRecord(ACCEPTED, variable=variable))
        for source, waiting in self._waiting.items():
            record = waiting.pop(subject, None) if source[0] == cell else None
            if record is not None:
                self._keep_now(source, subject, record, now)

    def _keep_now(self, source: _Source, subject: Hashable, record: Record, now: float) -> None:
        if now < math.inf:
            self._each.take((source, subject), now)
            self._of_writer.take(source, now)
            self._all.take(None, now)
        self._keep(record)


def _source(record: Record) -> _Source:
    return record.cell, record.event.writer or ""


def _subject(event: EventRecord) -> Hashable:
    host = None if event.peer is None else host_of(event.peer)
    return event.what, host, event.variable, event.lock, event.reason, event.holder


def _merged(former: Record, record: Record) -> Record:
    event = replace(
        record.event,
        old=former.event.old,
        times=former.event.times + record.event.times,
        detail=record.event.detail or former.event.detail,
    )
    return replace(record, event=event)


def _only_counted(record: Record) -> Record:
    what, writer = record.event.what, record.event.writer
    detail = f"further ones of {writer}, only counted"
    return replace(record, event=EventRecord(what, writer, times=record.event.times, detail=detail))
