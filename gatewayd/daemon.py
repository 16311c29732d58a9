"""The daemon: one process, one loop, several robot cells. The only module that knows every link.

A cell that fails costs that cell: a link whose task ends in an error is started again, a listener whose port is taken
is tried again, and the others never notice.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from gatewayd.core.cell import Cell
from gatewayd.eventlog import EventLog
from gatewayd.logs import fields
from gatewayd.mapping.plan import ModbusPlan, Plan
from gatewayd.modbus.peers import PeerEvent, PeerEventKind
from gatewayd.modbus.server import ListenError, ModbusListener
from gatewayd.robot.link import RobotLink

if TYPE_CHECKING:
    from gatewayd.canopen.link import CanLink
    from gatewayd.canopen.plan import CanopenPlan

__all__ = ["CLOSING_TIME", "RETRY_PERIOD", "TICK", "Daemon", "Link", "Station"]

TICK = 0.02
"""Seconds between two looks at leases, time-outs and staleness."""
RETRY_PERIOD = 2.0
"""Seconds between two attempts to open a listener or to start a failed link again."""
CLOSING_TIME = 0.5
"""Seconds that the last packages to the robots may take when the daemon stops."""

log = logging.getLogger("gatewayd.daemon")

Address = tuple[str, int]
"""Host and port of a listener."""


@dataclass
class Station:
    """One cell with its links."""

    plan: Plan
    state: Path
    """Directory of what the cell keeps across restarts."""
    cell: Cell = field(init=False)
    robot: RobotLink = field(init=False)
    can: CanLink | None = field(init=False)

    def __post_init__(self) -> None:
        self.cell = Cell(self.plan.cell)
        self.cell.events.listeners.append(EventLog(self.cell))
        self.robot = RobotLink(self.plan.robot, self.cell)
        self.can = self._can_link(self.plan.canopen) if self.plan.canopen is not None else None

    @property
    def links(self) -> tuple[Link, ...]:
        """What is to be run."""
        return (self.robot,) if self.can is None else (self.robot, self.can)

    def _can_link(self, plan: CanopenPlan) -> CanLink:
        # Most cells have no CAN, and start sooner without it.
        from gatewayd.canopen.link import CanLink  # noqa: PLC0415
        from gatewayd.canopen.storage import JsonStore  # noqa: PLC0415

        return CanLink(plan, self.cell, JsonStore(self.state / f"{self.plan.cell.name}.canopen.json"))


class Link(Protocol):
    """One connection to the outside."""

    async def run(self) -> None:
        """Work until cancelled."""

    async def close(self) -> None:
        """Send what is still due; `run` is cancelled afterwards."""


class Daemon:
    """Runs the cells of `plans` until told to stop; `state` is the directory of what is kept across restarts."""

    def __init__(self, plans: Sequence[Plan], state: Path) -> None:
        self.stations = [Station(plan, state) for plan in plans]
        units: dict[Address, list[tuple[ModbusPlan, Cell]]] = {}
        for station in self.stations:
            modbus = station.plan.modbus
            if modbus is not None:
                units.setdefault((modbus.host, modbus.port), []).append((modbus, station.cell))
        self.listeners: list[ModbusListener] = []
        for (host, port), served in units.items():
            listener = ModbusListener(host, port, observe=_log_peer)
            listener.serve(served)
            self.listeners.append(listener)

    async def run(self, stop: asyncio.Event) -> None:
        """Serve until `stop` is set; then release every lock, give the robots the fallbacks, and close."""
        clocks = [_keep_running(partial(_tick, station.cell)) for station in self.stations]
        links = [_keep_running(link.run) for station in self.stations for link in station.links]
        listeners = [_open(listener) for listener in self.listeners]
        async with asyncio.TaskGroup() as group:
            tasks = [group.create_task(work) for work in (*clocks, *listeners, *links)]
            await stop.wait()
            await self._close()
            for task in tasks:
                task.cancel()
        log.info("stopped")

    async def _close(self) -> None:
        """First nobody writes any more, then the robots get what the policies declare, then the links close."""
        await asyncio.gather(*(listener.close() for listener in self.listeners))
        now = time.monotonic()
        for station in self.stations:
            for writer in range(len(station.plan.cell.writers)):
                station.cell.release_all(writer, now, "the gateway stops")
        with suppress(TimeoutError):
            async with asyncio.timeout(CLOSING_TIME):
                await asyncio.gather(*(link.close() for station in self.stations for link in station.links))


async def _tick(cell: Cell) -> None:
    while True:
        cell.tick(time.monotonic())
        await asyncio.sleep(TICK)


async def _open(listener: ModbusListener) -> None:
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
            await asyncio.sleep(RETRY_PERIOD)
        else:
            log.info("listening for Modbus", extra=fields(listen=listener.name))
            return


async def _keep_running(work: Callable[[], Awaitable[None]]) -> None:
    """Start `work` again whenever it ends in an error, so that a defect in one cell never ends the process."""
    while True:
        try:
            await work()
        except Exception:
            log.exception("internal error, starting again")
            await asyncio.sleep(RETRY_PERIOD)
        else:
            return


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
