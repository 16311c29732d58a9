"""The listeners of all cells: one for each address, whatever number of units is behind it.

A listener whose address cannot be had is tried again until it can; one that nobody needs any more is closed.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from gatewayd.core.cell import Cell
from gatewayd.core.objection import Objection
from gatewayd.links.contract import Link, PrepareError, SharedPart, Tap
from gatewayd.links.modbus_server.default_unit import NamedPlan
from gatewayd.links.modbus_server.link import ModbusUnit
from gatewayd.links.modbus_server.listener import ListenError, ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.logs.records import fields
from gatewayd.loop.retry import reason_of, until_done
from gatewayd.mapping.plan import Plan

RETRY_PERIOD = 2.0
"""Seconds between two attempts to listen."""

log = logging.getLogger("gatewayd.daemon")

Address = tuple[str, int]
"""Host and port as the mapping has them."""


class Listeners(SharedPart):
    """All listeners of the daemon."""

    def __init__(self) -> None:
        self.listeners: list[ModbusListener] = []
        self._group: asyncio.TaskGroup | None = None
        self._opening: dict[ModbusListener, asyncio.Task[None]] = {}
        self._waits: Counter[ModbusListener] = Counter()
        """Progress of listeners that wait for another attempt."""

    async def run(self) -> None:
        """Open what is not open until cancelled."""
        async with asyncio.TaskGroup() as group:
            self._group = group
            try:
                for listener in self.listeners:
                    self._begin(listener)
                await asyncio.get_running_loop().create_future()
            finally:
                self._group = None

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
        wanted = {(unit.host, unit.port) for plan in plans for unit in plan.of(ModbusPlan).values()}
        present = {listener.address for listener in self.listeners}
        ports = {port for _host, port in present - wanted}
        opened = _Opened(self.listeners)
        for host, port in sorted(wanted - present):
            if port in ports:
                continue
            listener = _listener(host, port)
            try:
                await listener.start()
            except ListenError as error:
                await opened.abort()
                raise PrepareError(error.errno, reason_of(error)) from error
            opened.new.append(listener)
        return opened

    def disturbs(self, plans: Sequence[Plan]) -> Iterator[tuple[Cell, Objection]]:
        """Cells that would answer to the unit ids 0 and 255 no more."""
        units: dict[Address, list[NamedPlan]] = {listener.address: [] for listener in self.listeners}
        for plan in plans:
            for unit in plan.of(ModbusPlan).values():
                units.setdefault((unit.host, unit.port), []).append((plan.cell.name, unit))
        for listener in self.listeners:
            yield from listener.disturbs(units[listener.address])

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Have a listener for every address of these units, and no other."""
        served: dict[Address, list[ModbusUnit]] = {}
        for unit in links:
            assert isinstance(unit, ModbusUnit)
            served.setdefault((unit.plan.host, unit.plan.port), []).append(unit)
        for listener in [known for known in self.listeners if known.address not in served]:
            listener.serve((), successors)
            self.listeners.remove(listener)
            self._end(listener)
        for listener in self.listeners:
            _put(served.pop(listener.address), listener, successors)
        for (host, port), units in served.items():
            listener = _listener(host, port)
            _put(units, listener, {})
            self.listeners.append(listener)
            self._begin(listener)

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

        await until_done(listener.start, ListenError, report, RETRY_PERIOD, progress)
        log.info("listening for Modbus", extra=fields(listen=listener.name))


class _Opened:
    """Listeners that are open and serve nobody yet."""

    def __init__(self, listeners: list[ModbusListener]) -> None:
        self.new: list[ModbusListener] = []
        self._listeners = listeners

    def commit(self) -> None:
        """See Prepared."""
        self._listeners += self.new

    async def abort(self) -> None:
        """See Prepared."""
        await asyncio.gather(*(listener.close() for listener in self.new))


def _listener(host: str, port: int) -> ModbusListener:
    return ModbusListener(host, port, observe=_log_peer)


def _put(units: Sequence[ModbusUnit], listener: ModbusListener, successors: Mapping[Cell, Cell]) -> None:
    for unit in units:
        unit.listener = listener
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
        "reason": event.reason,
        "repeats": event.repeats,
    }
    log.log(
        logging.WARNING if event.kind.refused else logging.INFO,
        "Modbus client %s",
        event.kind.value,
        extra=fields(**{key: value for key, value in found.items() if value}),
    )
