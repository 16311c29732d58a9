"""The process put together: daemon, operator's access, service manager, reloader, status listener, signals."""

from __future__ import annotations

import asyncio
import logging
import math
import os
import time
from collections.abc import Callable
from pathlib import Path

from gatewayd.control.paths import default_socket
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.service.daemon import Daemon
from gatewayd.service.operator import OperatorAccess, Standstill
from gatewayd.service.options import Options
from gatewayd.service.reload import Reloader
from gatewayd.service.signals import SIGNALS, Effect, name_of
from gatewayd.service.startup import Startup, state_directory
from gatewayd.service.systemd import Notifier
from gatewayd.service.watchdog import ManagerReporter
from gatewayd.web.access_control import AccessControl
from gatewayd.web.launch import serve

QUIET = 10.0
"""Seconds for which further signals of a kind that is ignored are not logged."""

log = logging.getLogger("gatewayd.run")


def run(found: Startup, options: Options) -> None:
    """Serve until the end is asked for."""
    daemon = Daemon(found.plans, options.state or state_directory(os.environ))
    with asyncio.Runner(loop_factory=clock.ClockedLoop) as runner:
        runner.run(_serve(daemon, found, options))


async def _serve(daemon: Daemon, found: Startup, options: Options) -> None:
    stop = asyncio.Event()
    reporter = ManagerReporter(Notifier(os.environ, os.getpid()), daemon, found.notes)
    reloader = Reloader(
        daemon, options.files, reporter.reload_begins, lambda outcome: reporter.reload_ended(outcome.notes)
    )
    control = control_socket(options.control)
    SIGNALS.follow(asyncio.get_running_loop(), SignalActions(stop, reloader.ask))
    if stop.is_set():
        return
    standstill = Standstill()
    clock.on_gap(standstill.gap)
    network = AccessControl(options.page, lambda: daemon.cells) if options.page is not None else None
    access = OperatorAccess(
        daemon,
        control,
        options.audit,
        lambda: (*reporter.notes, *_troubles(network)),
        lambda accept: reloader.reload(accept=accept),
        stood_still=standstill.seconds,
    )
    reporter.remarks = access.troubles
    reporting = asyncio.create_task(reporter.run(stop))
    operating = asyncio.create_task(access.run())
    besides = [operating, asyncio.create_task(reloader.run())]
    if network is not None:
        api = access.api, access.reload
        page = serve(
            network,
            daemon,
            api,
            lambda: reporter.notes,
            lambda: [*access.troubles(), *_troubles(network)],
        )
        besides.append(asyncio.create_task(page))
    await daemon.run(stop)
    for task in besides:
        task.cancel()
    await asyncio.wait((operating,))
    await reporting
    SIGNALS.leave()


def _troubles(network: AccessControl | None) -> list[str]:
    return [] if network is None else network.troubles(time.time())


def control_socket(named: Path | None) -> Path | None:
    """Where to listen for commands; None: nowhere."""
    if named is not None:
        return None if str(named) == "none" else named
    found = default_socket(os.environ)
    if found is None:
        logging.getLogger("gatewayd.control").warning(
            "no place for a control socket, gatewayd status and watch cannot ask this gateway",
            extra=fields(
                reason="neither a service nor a session (XDG_RUNTIME_DIR)",
                remedy="gatewayd run --control PATH",
            ),
        )
    return found


class SignalActions:
    """Carries out what a signal asks for."""

    def __init__(self, stop: asyncio.Event, reload: Callable[[], None]) -> None:
        self._stop = stop
        self._reload = reload
        self._logged: dict[int, float] = {}

    def __call__(self, number: int, effect: Effect) -> None:
        """For `gatewayd.service.signals.Signals.follow`."""
        if effect is Effect.END:
            log.info("stopping", extra=fields(signal=name_of(SIGNALS.stopped_by)))
            self._stop.set()
        elif effect is Effect.RELOAD:
            self._reload()
        elif clock.now() - self._logged.get(number, -math.inf) >= QUIET:
            self._logged[number] = clock.now()
            log.warning("signal ignored", extra=fields(signal=name_of(number)))
