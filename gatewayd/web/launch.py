"""Brings the status listener up beside a daemon that serves already, and never in its way.

What is imported here late is imported in a thread, because the loop has packages to move meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING

from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.retry import keep_running, reason_of, until_done
from gatewayd.loop.threads import in_daemon_thread
from gatewayd.report.format import address
from gatewayd.service.daemon import Daemon
from gatewayd.web.access_control import AccessControl
from gatewayd.web.probes import Probes

if TYPE_CHECKING:
    from gatewayd.control.api import Api
    from gatewayd.control.endpoint import Reload
    from gatewayd.web.listener import StatusListener

RETRY_PERIOD = 2.0
FILES_PERIOD = 0.5
"""Seconds between two looks at tokens and certificates: how long a revoked token may go on at most."""
ENDING_PERIOD = 0.25
"""Seconds between two looks at what tokens hold."""
_LOOK = 0.05

log = logging.getLogger("gatewayd.status")


async def serve(
    access: AccessControl,
    daemon: Daemon,
    api: tuple[Api, Reload | None] | None = None,
    notes: Callable[[], Iterable[str]] = lambda: (),
    remarks: Callable[[], Iterable[str]] = lambda: (),
) -> None:
    """Measure and listen until cancelled. An address that cannot be had is said once and tried again."""
    probes = Probes(daemon, notes, remarks)
    beside = [
        asyncio.create_task(probes.run()),
        asyncio.create_task(_keep(lambda: _follow_files(access))),
        asyncio.create_task(_keep(lambda: _end_what_ended(access))),
    ]
    try:
        await _until_serving(daemon)
        await keep_running(
            lambda: _listen(access, probes, api),
            log,
            RETRY_PERIOD,
            what="internal error, starting the status listener again",
        )
    finally:
        for task in beside:
            task.cancel()
        for task in beside:
            with suppress(asyncio.CancelledError):
                await task


async def _keep(work: Callable[[], Awaitable[None]]) -> None:
    await keep_running(work, log, RETRY_PERIOD)


async def _end_what_ended(access: AccessControl) -> None:
    """End what tokens hold that count no more. Apart from the files, which may be on a file system that hangs."""
    while access.credentials is not None:
        for ended in access.credentials.end_what_ended(clock.now(), time.time()):
            log.warning("what a token held has ended", extra=fields(reason=ended))
        await asyncio.sleep(ENDING_PERIOD)


async def _follow_files(access: AccessControl) -> None:
    """Read tokens and certificates again when they change, and report what somebody has to do about them."""
    said: set[str] = set()
    while True:
        await in_daemon_thread(access.refresh, "status listener files")
        troubles = set(access.troubles(time.time()))
        for trouble in sorted(troubles - said):
            log.warning("the status listener needs attention", extra=fields(reason=trouble))
        said = troubles
        await asyncio.sleep(FILES_PERIOD)


async def _until_serving(daemon: Daemon) -> None:
    while not all(daemon.progress().values()):  # noqa: ASYNC110 - parts count, they have no event to wait for
        await asyncio.sleep(_LOOK)


class _NotYet(OSError):
    """What has to be done before the listener may be opened."""


async def _listen(access: AccessControl, probes: Probes, api: tuple[Api, Reload | None] | None) -> None:
    module = await asyncio.to_thread(import_module, "gatewayd.web.listener")
    settings = access.settings

    async def attempt() -> StatusListener:
        if access.obstacle:
            raise _NotYet(access.obstacle)
        listener: StatusListener = module.StatusListener(access, probes, api)
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
    scheme = "http" if settings.tls is None else "https"
    log.info("status page", extra=fields(url=f"{scheme}://{address(settings.host, listener.port)}/"))
    try:
        await asyncio.get_running_loop().create_future()
    finally:
        await listener.close()
