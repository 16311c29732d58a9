"""The daemon: one process, one loop, several robot cells. The only module that knows every link.

A cell that fails costs that cell: a link whose task ends in an error is started again, a listener whose port is taken
is tried again, and the others never notice. A core whose ticks fail is left to the watchdog: nobody would notice what
only time brings, and nothing may look fresh that nobody looks after.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import zip_longest
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.modbus_server.listener import ListenError, ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent, PeerEventKind
from gatewayd.links.modbus_server.plan import ModbusPlan, modbus_of
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.progress import turning
from gatewayd.mapping.plan import Plan
from gatewayd.service.cell_runtime import Station

__all__ = ["CLOSING_TIME", "RETRY_PERIOD", "TICK", "Daemon"]

TICK = 0.02
"""Seconds between two looks at leases, time-outs and staleness."""
RETRY_PERIOD = 2.0
"""Seconds between two attempts to open a listener or to start a failed link again."""
CLOSING_TIME = 0.5
"""Seconds that the last packages to the robots may take when the daemon stops."""

log = logging.getLogger("gatewayd.daemon")

Address = tuple[str, int]
"""Host and port of a listener."""


class Daemon:
    """Runs the cells of `plans` until told to stop; `state` is the directory of what is kept across restarts."""

    def __init__(self, plans: Sequence[Plan], state: Path) -> None:
        self._state = state
        self.stations = [Station(plan, state) for plan in plans]
        self.listeners: list[ModbusListener] = []
        self._group: asyncio.TaskGroup | None = None
        self._tasks: dict[object, asyncio.Task[None]] = {}
        """Of stations (their clocks), links and listeners."""
        self._rests: Counter[object] = Counter()
        """Turns of parts while they do not run: a link after an error, a listener whose port is taken."""
        self._observers: list[Callable[[Cell], None]] = []
        self._serve({})

    @property
    def cells(self) -> list[Cell]:
        """The cells that are served now."""
        return [station.cell for station in self.stations]

    def observe(self, observer: Callable[[Cell], None]) -> None:
        """Call `observer` with every cell, now and whenever a reload brings one, before anybody writes to it."""
        self._observers.append(observer)
        for cell in self.cells:
            observer(cell)

    def turns(self) -> dict[str, int]:
        """A counter for each part that has to go on: cores, links, listeners. 0: it has not begun."""
        rests = self._rests
        found = {f"listener {one.name}": one.turns + rests[one] for one in self.listeners}
        for station in self.stations:
            name, robot, can = station.plan.cell.name, station.robot, station.can
            found[f"core of {name}"] = station.cell.health.heartbeat
            found[f"robot link of {name}"] = robot.turns + rests[robot]
            if can is not None:
                found[f"CAN link of {name}"] = can.turns + rests[can]
        return found

    def troubles(self) -> list[str]:
        """What concerns the gateway as a whole."""
        return [f"not listening on {one.name}" for one in self.listeners if not one.listening]

    async def run(self, stop: asyncio.Event) -> None:
        """Serve until `stop` is set; then release every lock, give the robots the fallbacks, and close."""
        clock.on_gap(self._after_gap)
        async with asyncio.TaskGroup() as group:
            self._group = group
            for station in self.stations:
                self._begin_station(station)
            for listener in self.listeners:
                self._begin(listener, partial(self._open, listener))
            await stop.wait()
            self._group = None
            await self._close()
            for task in list(self._tasks.values()):
                task.cancel()
        log.info("stopped")

    def _after_gap(self, gap: clock.Gap) -> None:
        """The process stood still; nothing that waited meanwhile has been served yet."""
        for station in self.stations:
            station.gap(gap.since, gap.until)
        for listener in self.listeners:
            listener.gap(gap.since, gap.until)

    # -- another mapping ---------------------------------------------------------------------------------------------

    @property
    def running(self) -> bool:
        """Whether there is anything to swap: false before `run` and once it stops."""
        return self._group is not None

    async def open_new(self, plans: Iterable[Plan]) -> list[ModbusListener]:
        """Listeners for addresses that are new, open, but serving nobody yet. Raises ListenError, all closed again.

        One that must wait for the end of a present listener, of the same port, is left to `swap`.
        """
        wanted = {(unit.host, unit.port) for plan in plans if (unit := modbus_of(plan)) is not None}
        present = {listener.address for listener in self.listeners}
        ports = {port for _host, port in present - wanted}
        opened: list[ModbusListener] = []
        for host, port in sorted(wanted - present):
            if port in ports:
                continue
            listener = ModbusListener(host, port, observe=_log_peer)
            try:
                await listener.start()
            except ListenError:
                await asyncio.gather(*(one.close() for one in opened))
                raise
            opened.append(listener)
        return opened

    def swap(self, plans: Sequence[Plan], now: float, opened: Iterable[ModbusListener] = ()) -> list[str]:
        """Serve these plans instead, between two packages; cells are known by their names.

        Links whose settings did not change stay up. Returns the inputs that are gone and could not be given their
        release fallback, as `cell: name`.
        """
        former = {station.plan.cell.name: station for station in self.stations}
        successors: dict[Cell, Cell] = {}
        stranded: list[str] = []
        self.listeners += opened
        # Whatever happens on the way, afterwards the listeners serve the cells that there are.
        try:
            stations = [self._station_for(plan, former, now, successors, stranded) for plan in plans]
            for station in former.values():
                stranded += [f"{station.plan.cell.name}: {name}" for name in station.retire(now)]
                for part in (station, *station.links):
                    self._end(part)
            self.stations = stations
        finally:
            self._serve(successors)
        return stranded

    def _station_for(
        self,
        plan: Plan,
        former: dict[str, Station],
        now: float,
        successors: dict[Cell, Cell],
        stranded: list[str],
    ) -> Station:
        station = former.pop(plan.cell.name, None)
        if station is None:
            station = Station(plan, self._state)
            self._show(station.cell)
            self._begin_station(station)
        elif station.plan != plan:
            stranded += self._replace(station, plan, now, successors)
        return station

    def _replace(self, station: Station, plan: Plan, now: float, successors: dict[Cell, Cell]) -> list[str]:
        cell, links = station.cell, station.links
        stranded = station.succeed(plan, now)
        self._show(station.cell)
        station.cell.health.modbus_connections = 0
        successors[cell] = station.cell
        for link, former in zip_longest(station.links, links):
            if link is not former:
                ended = self._end(former) if former is not None else None
                if link is not None:
                    self._begin(link, partial(self._keep_running, link, link.run), ended)
        return [f"{plan.cell.name}: {name}" for name in stranded]

    def _show(self, cell: Cell) -> None:
        for observer in self._observers:
            observer(cell)

    def _serve(self, successors: Mapping[Cell, Cell]) -> None:
        """Have a listener for every address of the stations' plans, and no other."""
        units: dict[Address, list[tuple[ModbusPlan, Cell]]] = {}
        for station in self.stations:
            modbus = modbus_of(station.plan)
            if modbus is not None:
                units.setdefault((modbus.host, modbus.port), []).append((modbus, station.cell))
        for listener in [one for one in self.listeners if one.address not in units]:
            listener.serve((), successors)
            self.listeners.remove(listener)
            self._begin(listener, partial(listener.close, "no longer configured"), self._end(listener))
        for listener in self.listeners:
            listener.serve(units.pop(listener.address), successors)
        for (host, port), served in units.items():
            listener = ModbusListener(host, port, observe=_log_peer)
            listener.serve(served)
            self.listeners.append(listener)
            self._begin(listener, partial(self._open, listener))

    def _begin_station(self, station: Station) -> None:
        self._begin(station, partial(self._keep_running, station, partial(self._tick, station)))
        for link in station.links:
            self._begin(link, partial(self._keep_running, link, link.run))

    async def _tick(self, station: Station) -> None:
        while True:
            adoption = station.cell.adoption
            adoption.reachable = adoption.reachable or self._is_reachable(station)
            station.cell.tick(clock.judged_now())
            await asyncio.sleep(TICK)

    def _is_reachable(self, station: Station) -> bool:
        """Whether a writer can reach the cell; one without a fieldbus waits for none."""
        modbus = modbus_of(station.plan)
        if modbus is None and station.can is None:
            return True
        served = modbus is not None and any(
            listener.listening and listener.address == (modbus.host, modbus.port)
            for listener in self.listeners
        )
        return served or station.is_on_bus

    def _begin(
        self, part: object, work: Callable[[], Awaitable[None]], former: asyncio.Task[None] | None = None
    ) -> None:
        """Have the part's work done, once a former task has ended. Before `run` it is left to that."""
        if self._group is not None:
            task = self._tasks[part] = self._group.create_task(_after(former, work))
            task.add_done_callback(lambda ended: self._forget(part, ended))

    def _forget(self, part: object, task: asyncio.Task[None]) -> None:
        if self._tasks.get(part) is task:
            del self._tasks[part]
            del self._rests[part]

    def _end(self, part: object) -> asyncio.Task[None] | None:
        """Have the part's work cancelled; returns its task, which still says goodbye."""
        task = self._tasks.pop(part, None)
        del self._rests[part]
        if task is not None:
            task.cancel()
        return task

    async def _rest(self, part: object) -> None:
        def turn() -> None:
            self._rests[part] += 1

        await turning(asyncio.sleep(RETRY_PERIOD), turn, RETRY_PERIOD)

    async def _open(self, listener: ModbusListener) -> None:
        """Open the listener; while that fails, say why once and try again."""
        told = ""
        while True:
            try:
                await listener.start()
            except ListenError as error:
                reason = error.strerror or str(error)
                if reason != told:
                    told = reason
                    log.error(told, extra=fields(retry_s=RETRY_PERIOD))  # noqa: TRY400 - the text says it all
                await self._rest(listener)
            else:
                log.info("listening for Modbus", extra=fields(listen=listener.name))
                return

    async def _keep_running(self, part: object, work: Callable[[], Awaitable[None]]) -> None:
        """Start `work` again whenever it ends in an error, so that a defect in one cell never ends the process."""
        while True:
            try:
                await work()
            except Exception:
                log.exception("internal error, starting again")
                await self._rest(part)
            else:
                return

    async def _close(self) -> None:
        """First nobody writes any more, then the robots get what the policies declare, then the links close."""
        await asyncio.gather(*(listener.close() for listener in self.listeners))
        now = clock.now()
        for station in self.stations:
            station.cell.stop(now, "the gateway stops")
        with suppress(TimeoutError):
            async with asyncio.timeout(CLOSING_TIME):
                await asyncio.gather(*(link.close() for station in self.stations for link in station.links))


async def _after(former: asyncio.Task[None] | None, work: Callable[[], Awaitable[None]]) -> None:
    """Do the work once the former task has ended; if cancelled before, end after it all the same."""
    if former is not None:
        try:
            await asyncio.wait((former,))
        except asyncio.CancelledError:
            await asyncio.wait((former,))
            raise
    await work()


_PEER_LEVELS = {PeerEventKind.DENIED: logging.WARNING, PeerEventKind.FULL: logging.WARNING}


def _log_peer(event: PeerEvent) -> None:
    found: dict[str, object] = {
        "peer": event.peer,
        "writer": ",".join(event.writers),
        "reason": event.reason,
        "repeats": event.repeats,
    }
    level = _PEER_LEVELS.get(event.kind, logging.INFO)
    log.log(
        level, "Modbus client %s", event.kind.value, extra=fields(**{k: v for k, v in found.items() if v})
    )
