"""The listeners of all cells: one for each address, whatever number of units is behind it.

A listener whose address cannot be had is tried again until it can; one that nobody needs any more is closed.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from gatewayd.core.cell import Cell
from gatewayd.core.objection import Objection
from gatewayd.links.contract import Link, PrepareError, SharedPart, Tap
from gatewayd.links.modbus_server.default_unit import NamedPlan
from gatewayd.links.modbus_server.link import ModbusUnit
from gatewayd.links.modbus_server.listener import ListenError, ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent
from gatewayd.links.modbus_server.plan import Endpoint, ModbusPlan, TrustFiles
from gatewayd.logs.records import fields
from gatewayd.loop.retry import reason_of, until_done
from gatewayd.mapping.plan import Plan

if TYPE_CHECKING:
    from gatewayd.links.modbus_server.trust import Trust

RETRY_PERIOD = 2.0
"""Seconds between two attempts to listen."""

log = logging.getLogger("gatewayd.daemon")

_Key = tuple[Endpoint, bool]
"""Where it listens, and whether with TLS."""


class Listeners(SharedPart):
    """All listeners of the daemon."""

    def __init__(self) -> None:
        self.listeners: list[ModbusListener] = []
        self._group: asyncio.TaskGroup | None = None
        self._opening: dict[ModbusListener, asyncio.Task[None]] = {}
        self._secured = asyncio.Event()
        """Set when a listener with TLS may have come."""
        self._waits: Counter[ModbusListener] = Counter()
        """Progress of listeners that wait for another attempt."""

    async def run(self) -> None:
        """Open what is not open until cancelled."""
        async with asyncio.TaskGroup() as group:
            self._group = group
            try:
                for listener in self.listeners:
                    self._begin(listener)
                await self._keep_renewed()
            finally:
                self._group = None

    async def _keep_renewed(self) -> None:
        while not any(listener.files is not None for listener in self.listeners):
            self._secured.clear()
            await self._secured.wait()
        from gatewayd.links.modbus_server.renewal import keep_renewed  # noqa: PLC0415 - where a listener has TLS

        await keep_renewed(lambda: self.listeners)

    async def refresh(self) -> Sequence[str]:
        """See SharedPart: certificates."""
        secured = [listener for listener in self.listeners if listener.files is not None]
        if not secured:
            return ()
        from gatewayd.links.modbus_server.renewal import renew_changed  # noqa: PLC0415 - where a listener has TLS

        return await renew_changed(secured)

    def progress(self) -> dict[str, int]:
        """Attempts, then sweeps, of each listener."""
        return {f"listener {known.name}": known.progress + self._waits[known] for known in self.listeners}

    def troubles(self) -> list[str]:
        """Addresses that cannot be had."""
        return [f"not listening on {known.name}" for known in self.listeners if not known.listening]

    def gap(self, since: float, now: float) -> None:
        """What is in the sockets may have waited."""
        for listener in self.listeners:
            listener.gap(since, now)

    def trace(self, tap: Tap | None) -> None:
        """All frames, with the cells that their units are."""
        for listener in self.listeners:
            listener.trace(tap)

    async def prepare(self, plans: Sequence[Plan]) -> _Opened:
        """Open the addresses that are new; they serve nobody yet. Raises PrepareError, all closed again.

        One that must wait for the end of a present listener, of the same port, is left to `serve`.
        """
        wanted = _endpoints(unit for plan in plans for unit in plan.of(ModbusPlan).values())
        present = {_key(listener): listener for listener in self.listeners}
        ports = {port for (_host, port), _secured in present.keys() - wanted.keys()}
        opened = _Opened(self.listeners)
        try:
            for key in sorted(wanted.keys() - present.keys()):
                (host, port), _secured = key
                if port not in ports:
                    listener = _listener(host, port, wanted[key])
                    await _start(listener)
                    opened.new.append(listener)
            for key, files in wanted.items():
                if key in present and files is not None and files != present[key].files:
                    opened.renewed.append((present[key], await _read(present[key], files)))
        except ListenError as error:
            await opened.abort()
            raise PrepareError(error.errno, reason_of(error)) from error
        return opened

    def disturbs(self, plans: Sequence[Plan]) -> Iterator[tuple[Cell, Objection]]:
        """Cells that would answer to the unit ids 0 and 255 no more."""
        units: dict[_Key, list[NamedPlan]] = {_key(listener): [] for listener in self.listeners}
        for plan in plans:
            for unit in plan.of(ModbusPlan).values():
                for key in _endpoints([unit]):
                    units.setdefault(key, []).append((plan.cell.name, unit))
        for listener in self.listeners:
            yield from listener.disturbs(units[_key(listener)])

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Have a listener for every address of these units, and no other."""
        served: dict[_Key, list[ModbusUnit]] = {}
        for unit in links:
            assert isinstance(unit, ModbusUnit)
            unit.listeners.clear()
            for key in _endpoints([unit.plan]):
                served.setdefault(key, []).append(unit)
        for listener in [known for known in self.listeners if _key(known) not in served]:
            listener.serve((), successors)
            self.listeners.remove(listener)
            self._end(listener)
        for listener in self.listeners:
            _put(served.pop(_key(listener)), listener, successors)
        for key, units in served.items():
            (host, port), _secured = key
            listener = _listener(host, port, _endpoints(unit.plan for unit in units)[key])
            _put(units, listener, {})
            self.listeners.append(listener)
            self._begin(listener)
        self._secured.set()

    async def close(self) -> None:
        """Close all of them; connections end at once."""
        await asyncio.gather(*(listener.close() for listener in self.listeners))

    def _begin(self, listener: ModbusListener) -> None:
        """Open it, if `run` does not still have to begin."""
        if self._group is not None and not listener.listening:
            task = self._opening[listener] = self._group.create_task(self._open(listener))
            task.add_done_callback(lambda _task: self._opening.pop(listener, None))

    def _end(self, listener: ModbusListener) -> None:
        """Close it, once it is no longer being opened."""
        opening = self._opening.pop(listener, None)
        del self._waits[listener]
        if self._group is not None:
            self._group.create_task(_close(listener, opening))

    async def _open(self, listener: ModbusListener) -> None:
        def report(error: Exception) -> None:
            log.error(reason_of(error), extra=fields(retry_s=RETRY_PERIOD))

        def progress() -> None:
            self._waits[listener] += 1

        await until_done(partial(_start, listener), ListenError, report, RETRY_PERIOD, progress)
        log.info("listening for Modbus", extra=fields(listen=listener.name))


class _Opened:
    """Listeners that are open and serve nobody yet."""

    def __init__(self, listeners: list[ModbusListener]) -> None:
        self.new: list[ModbusListener] = []
        self.renewed: list[tuple[ModbusListener, Trust]] = []
        self._listeners = listeners

    def commit(self) -> None:
        """See Prepared."""
        self._listeners += self.new
        for listener, trust in self.renewed:
            listener.renew(trust)

    async def abort(self) -> None:
        """See Prepared."""
        await asyncio.gather(*(listener.close() for listener in self.new))


def _listener(host: str, port: int, files: TrustFiles | None) -> ModbusListener:
    return ModbusListener(host, port, files=files, observe=_log_peer)


def _key(listener: ModbusListener) -> _Key:
    return listener.address, listener.files is not None


def _endpoints(plans: Iterable[ModbusPlan]) -> dict[_Key, TrustFiles | None]:
    """Where these are reached. Of cells that name different files for one listener the first counts (GW231)."""
    found: dict[_Key, TrustFiles | None] = {}
    for plan in plans:
        for endpoint, files in plan.endpoints.items():
            found.setdefault((endpoint, files is not None), files)
    return found


async def _start(listener: ModbusListener) -> None:
    """Raises ListenError."""
    if listener.files is not None:
        from gatewayd.links.modbus_server.renewal import make_ready  # noqa: PLC0415 - where a listener has TLS

        await make_ready(listener)
    await listener.start()


async def _read(listener: ModbusListener, files: TrustFiles) -> Trust:
    """Raises ListenError."""
    from gatewayd.links.modbus_server.renewal import read  # noqa: PLC0415 - where a listener has TLS
    from gatewayd.links.modbus_server.trust import TrustError  # noqa: PLC0415

    try:
        return await read(files)
    except TrustError as error:
        raise ListenError(error.errno, f"{listener.name}: {error}") from error


def _put(units: Sequence[ModbusUnit], listener: ModbusListener, successors: Mapping[Cell, Cell]) -> None:
    for unit in units:
        unit.listeners.append(listener)
    listener.serve([(unit.plan, unit.cell) for unit in units], successors)


async def _close(listener: ModbusListener, opening: asyncio.Task[None] | None) -> None:
    if opening is not None:
        opening.cancel()
        await asyncio.wait((opening,))
    await listener.close("no longer configured")


def _log_peer(event: PeerEvent) -> None:
    found: dict[str, object] = {
        "peer": event.peer,
        "writer": ",".join(event.writers),
        "role": None if event.credentials is None else event.credentials.role or "none",
        "certificate": None if event.credentials is None else event.credentials.name,
        "reason": event.reason,
        "repeats": event.repeats,
    }
    log.log(
        logging.WARNING if event.kind.refused else logging.INFO,
        "Modbus client %s",
        event.kind.value,
        extra=fields(**{key: value for key, value in found.items() if value}),
    )
