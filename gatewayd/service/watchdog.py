"""The running gateway as a service: its manager learns when it is ready, how it is, that it lives, and when it ends.

Readiness means that every link was tried and the core ticks, not that a robot or a PLC is there: those come and go.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Protocol

from gatewayd.control.api import Gateway
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.report.summary import summary
from gatewayd.report.verdict import verdict_of
from gatewayd.service.liveness import Liveness, Progressed
from gatewayd.service.systemd import Notifier

PERIOD = 0.5
"""Seconds between two looks; a quarter of the watchdog's time where that is less."""
STATUS_PERIOD = 5.0
"""Seconds after which a summary whose numbers alone have changed is sent again."""

log = logging.getLogger("gatewayd.service")


class Watched(Gateway, Protocol):
    """What a service needs to know of the daemon."""

    def progress(self) -> Mapping[str, int]:
        """A counter for each part that has to go on; 0: it has not begun."""


class ManagerReporter:
    """Reports on `daemon` while `run` runs. `notes` are troubles that stay until somebody changes them."""

    def __init__(self, notifier: Notifier, daemon: Watched, notes: Sequence[str] = ()) -> None:
        self.notes = tuple(notes)
        self.late: tuple[str, ...] = ()
        """Parts that hang."""
        self.remarks: Callable[[], Sequence[str]] = tuple
        """What is wrong with audit and log; with it the cells are served all the same."""
        self._notifier = notifier
        self._daemon = daemon
        self._liveness = Liveness()
        self._progressed = Progressed()
        self._ready = False
        self._reported = ""
        self._reported_at = 0.0
        self._failed = ""

    async def run(self, stop: asyncio.Event) -> None:
        """Report until `stop` is set. A defect here is logged once; the watchdog then goes unfed."""
        after = self._notifier.watchdog_after
        period = PERIOD if after is None else min(PERIOD, after / 4)
        while not stop.is_set():
            try:
                self.look(clock.now())
            except Exception as error:
                if self._failed != str(error):
                    self._failed = str(error)
                    log.exception("internal error")
            with suppress(TimeoutError):
                async with asyncio.timeout(period):
                    await stop.wait()
        self._notifier.stopping("stopping: releasing locks, sending the robots their fallbacks")

    def look(self, now: float) -> None:
        """Look at everything once and report."""
        counts = self._daemon.progress()
        late = self._liveness.late(counts, now)
        for name in late:
            if name not in self.late:
                log.error("a part of the gateway hangs", extra=fields(part=name))
        self.late = late
        if not self._ready:
            self._ready = all(counts.values()) and self._notifier.ready()
        if self._progressed.all_of(counts):
            self._notifier.watchdog()
        self._report(now)

    def reload_begins(self) -> None:
        """Report that a reload has begun; `reload_ended` has to follow."""
        self._notifier.reloading(time.monotonic(), "reloading")

    def reload_ended(self, notes: Sequence[str] = ()) -> None:
        """Report that the reload is over; `notes` is what came of it and is to be seen until the next one."""
        self.notes = tuple(notes)
        self._reported = self._summary(clock.now())
        self._notifier.ready(self._reported)

    def _report(self, now: float) -> None:
        text = self._summary(now)
        if text == self._reported:
            return
        if _words(text) != _words(self._reported) or now - self._reported_at >= STATUS_PERIOD:
            self._reported, self._reported_at = text, now
            self._notifier.status(text)

    def _summary(self, now: float) -> str:
        hanging = (f"hangs: {name}" for name in self.late)
        cells = [(served.cell, verdict_of(served, now)) for served in self._daemon.runtimes]
        return summary(cells, [*hanging, *self.notes, *self._daemon.troubles(), *self.remarks()])


_WITHOUT_RATES = str.maketrans("", "", "0123456789")


def _words(text: str) -> str:
    """The summary without its numbers: a rate that wavers is no news, a robot that is lost is."""
    return text.translate(_WITHOUT_RATES)
