"""What those who run the gateway use beside the fieldbus: the audit and its file, and the control socket."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Protocol

from gatewayd.audit.file import AuditFile
from gatewayd.audit.trail import Audit
from gatewayd.control.api import Api
from gatewayd.control.endpoint import Endpoint, Reload
from gatewayd.control.trace import TracedGateway
from gatewayd.core.cell import Cell
from gatewayd.logs.stream import log_troubles
from gatewayd.loop import clock
from gatewayd.loop.retry import keep_running
from gatewayd.service.daemon import RETRY_PERIOD
from gatewayd.service.watchdog import Watched

JUST_NOW = 0.1
"""Seconds after the process stood still in which what waited meanwhile is served."""
_LOOK = 1.0

log = logging.getLogger("gatewayd.operation")


class Standstill:
    """Remembers the last gap of the loop, and says how long it was while it counts as of just now.

    A gap that comes before the loop was awake for JUST_NOW prolongs the one before it: what waited then waits still.
    """

    def __init__(self) -> None:
        self._since = self._until = -math.inf
        self._awake = 0.0
        """Seconds between the gaps that are one."""

    def gap(self, gap: clock.Gap) -> None:
        """The process stood still. For `gatewayd.loop.clock.on_gap`."""
        self._awake += gap.since - self._until
        if self._awake > JUST_NOW:
            self._since, self._awake = gap.since, 0.0
        self._until = gap.until

    def seconds(self) -> float:
        """For how long the process stood still until just now; 0.0: it did not."""
        awake = self._awake + clock.now() - self._until
        return self._until - self._since if awake <= JUST_NOW else 0.0


class Operated(Watched, TracedGateway, Protocol):
    """What is needed of the daemon."""

    @property
    def cells(self) -> Iterable[Cell]:
        """The cells that are served now."""

    def observe(self, observer: Callable[[Cell], None]) -> None:
        """Have `observer` called with every cell before anybody writes to it."""


class OperatorAccess:
    """The audit from the first write on; the control socket at `control` once the gateway serves. None: without."""

    def __init__(
        self,
        daemon: Operated,
        control: Path | None,
        audit_file: Path | None,
        notes: Callable[[], Sequence[str]] = lambda: (),
        reload: Reload | None = None,
        *,
        stood_still: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self.reload = reload
        self._daemon = daemon
        self._control = control
        self._file = AuditFile(audit_file) if audit_file is not None else None
        self.audit = Audit(self._file.put if self._file is not None else None)
        daemon.observe(self.audit.watch)
        self.api = Api(daemon, self.audit, lambda: (*notes(), *self.troubles()), stood_still, traced=daemon)

    async def run(self) -> None:
        """Run until cancelled; then write what is still to be written."""
        try:
            await keep_running(self._run, log, RETRY_PERIOD)
        finally:
            if self._file is not None:
                self._file.close()

    async def _run(self) -> None:
        async with asyncio.TaskGroup() as group:
            group.create_task(self.audit.run(lambda: self._daemon.cells))
            if self._file is not None:
                group.create_task(self._watch(self._file))
            if self._control is not None:
                group.create_task(Endpoint(self._control, self.api, self._is_serving, self.reload).run())

    def _is_serving(self) -> bool:
        return all(self._daemon.progress().values())

    def troubles(self) -> list[str]:
        """What is wrong with audit and log; the cells are served all the same."""
        trouble = self._file.trouble(clock.now()) if self._file is not None else ""
        of_file = [f"the audit file cannot be written: {trouble}"] if trouble else []
        return [*of_file, *self.audit.troubles, *log_troubles(clock.now())]

    async def _watch(self, file: AuditFile) -> None:
        while True:
            file.look(clock.now())
            await asyncio.sleep(_LOOK)
