"""Brings the status listener up beside a daemon that serves already, and never in its way.

What is imported here late is imported in a thread, because the loop has packages to move meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterable
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING

from gatewayd.logs.records import fields
from gatewayd.loop.retry import keep_running, reason_of, until_done
from gatewayd.report.format import address
from gatewayd.service.daemon import Daemon
from gatewayd.web.probes import Probes
from gatewayd.web.settings import Settings

if TYPE_CHECKING:
    from gatewayd.control.api import Api
    from gatewayd.control.endpoint import Reload
    from gatewayd.web.listener import StatusListener

RETRY_PERIOD = 2.0
_LOOK = 0.05

log = logging.getLogger("gatewayd.status")


async def serve(
    settings: Settings,
    daemon: Daemon,
    api: tuple[Api, Reload | None] | None = None,
    notes: Callable[[], Iterable[str]] = lambda: (),
    remarks: Callable[[], Iterable[str]] = lambda: (),
) -> None:
    """Measure and listen until cancelled. An address that cannot be had is said once and tried again."""
    probes = Probes(daemon, notes, remarks)
    measuring = asyncio.create_task(probes.run())
    try:
        await _until_serving(daemon)
        await keep_running(
            lambda: _listen(settings, probes, api),
            log,
            RETRY_PERIOD,
            what="internal error, starting the status listener again",
        )
    finally:
        measuring.cancel()
        with suppress(asyncio.CancelledError):
            await measuring


async def _until_serving(daemon: Daemon) -> None:
    while not all(daemon.progress().values()):  # noqa: ASYNC110 - parts count, they have no event to wait for
        await asyncio.sleep(_LOOK)


async def _listen(settings: Settings, probes: Probes, api: tuple[Api, Reload | None] | None) -> None:
    module = await asyncio.to_thread(import_module, "gatewayd.web.listener")

    async def attempt() -> StatusListener:
        listener: StatusListener = module.StatusListener(
            settings.host, settings.port, probes, settings.token, api
        )
        await listener.start()
        return listener

    def report(error: Exception) -> None:
        log.error(
            "cannot listen for status requests",
            extra=fields(
                listen=address(settings.host, settings.port),
                reason=reason_of(error),
                retry_s=RETRY_PERIOD,
            ),
        )

    listener = await until_done(attempt, OSError, report, RETRY_PERIOD)
    log.info("status page", extra=fields(url=f"http://{address(settings.host, listener.port)}/"))
    try:
        await asyncio.get_running_loop().create_future()
    finally:
        await listener.close()
