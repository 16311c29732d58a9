"""Certificates, keys and revocation lists are read again when their files change, without dropping anybody.

Files that cannot be used change nothing: those that were read before stay in use, and that is a problem of the link
until they can be. Disks are read by a thread, so that a slow one holds up nothing.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Iterable
from functools import partial

from gatewayd.links.modbus_server.listener import ListenError, ModbusListener
from gatewayd.links.modbus_server.plan import TrustFiles
from gatewayd.links.modbus_server.trust import Trust, TrustError, load, paths_of, stamps_of
from gatewayd.links.modbus_server.trust_findings import expiring
from gatewayd.logs.records import fields
from gatewayd.loop.threads import in_daemon_thread

PERIOD = 5.0
"""Seconds between two looks at the files."""

log = logging.getLogger("gatewayd.modbus")


async def read(files: TrustFiles) -> Trust:
    """Read the files. Raises TrustError."""
    return await in_daemon_thread(partial(load, files, time.time()), "certificates")


async def make_ready(listener: ModbusListener) -> None:
    """Have a secured listener read its files; others have none. Raises ListenError."""
    if listener.files is None:
        return
    try:
        listener.renew(await read(listener.files))
    except TrustError as error:
        raise ListenError(error.errno, f"cannot listen on {listener.name}: {error}") from error
    report(listener)


async def keep_renewed(listeners: Callable[[], Iterable[ModbusListener]]) -> None:
    """Look at the files of these listeners until cancelled."""
    while True:
        await asyncio.sleep(PERIOD)
        await renew_changed(listeners())


async def renew_changed(listeners: Iterable[ModbusListener]) -> list[str]:
    """Read those files again that are others than before, or are used up; returns what is wrong with any."""
    problems = []
    for listener in list(listeners):
        files = listener.files
        if files is not None and listener.listening:
            stamps = await in_daemon_thread(partial(stamps_of, files), "certificates")
            used_up = listener.trust.is_used_up(time.time()) and not listener.problem
            if stamps != listener.stamps or used_up:
                await _renew(listener, files, stamps)
            if listener.problem:
                problems.append(listener.problem)
    return problems


async def _renew(listener: ModbusListener, files: TrustFiles, stamps: tuple[object, ...]) -> None:
    changed = stamps != listener.stamps
    try:
        trust = await read(files)
    except TrustError as error:
        listener.stamps = stamps  # said once; the next look is at another file
        listener.problem = f"{error}; the files that {listener.name} has read before stay in use"
        log.error(  # noqa: TRY400 - no defect of ours
            "certificates cannot be renewed", extra=fields(listen=listener.name, reason=str(error))
        )
        return
    if files == listener.files:  # a reload may have named others meanwhile
        listener.renew(trust)
        if changed:
            report(listener)


def problems_of(listener: ModbusListener) -> tuple[str, ...]:
    """What is wrong with the files of a listener that listens, or will be soon."""
    paths = paths_of(listener.trust.files)
    found = [
        f"{paths[its.key]} {its.text}: {its.remedy}" for its in expiring(listener.trust.facts, time.time())
    ]
    return (*([listener.problem] if listener.problem else []), *found)


def report(listener: ModbusListener) -> None:
    """Say what was read."""
    facts = listener.trust.facts
    dates = {key: time.strftime("%Y-%m-%d", time.gmtime(at)) for key, at in facts.expiries.items()}
    log.info("certificates read", extra=fields(listen=listener.name, **dates))
    if facts.exposed:
        log.warning(
            "the key can be read by everybody on this machine: chmod o-r",
            extra=fields(file=listener.trust.files.key),
        )
