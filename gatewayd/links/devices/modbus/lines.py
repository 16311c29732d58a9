"""The connections that Modbus devices are reached by: one for each address, whatever cells its devices belong to.

A device comes and goes without the others on its line noticing. Only where what they share changes (requests at the
same time, a connection for each request), the line begins anew with all of them.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, cast

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Link, Prepared, SharedPart, Tap
from gatewayd.links.devices.at_work import NothingPrepared, Work, WorkGroup, end_all
from gatewayd.links.devices.concerned import Concerned, DeviceId, concerned_by
from gatewayd.links.devices.modbus.plan import LineAddress, ModbusDevicePlan
from gatewayd.links.devices.modbus.tapped import TappedRunner, TappedTcpLine
from gatewayd.logs.records import fields
from gatewayd.mapping.plan import Plan
from gatewayd.modbus.client.line import ConnectionUse, Line, LineSettings
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.tcp import TcpAddress, TcpFrames
from gatewayd.report.wording import names_and_more

log = logging.getLogger("gatewayd.devices")


class DeviceOnLine(Protocol):
    """As much of a link as its line knows."""

    @property
    def plan(self) -> ModbusDevicePlan:
        """Where it is."""

    @property
    def station(self) -> Station:
        """What the line asks."""

    @property
    def device_id(self) -> DeviceId:
        """Which device it is."""

    def begin_anew(self) -> None:
        """Have a station that was on no line yet."""

    def stop(self) -> None:
        """The gateway stops."""


@dataclass(eq=False, slots=True)
class _LineAtWork:
    """One connection with its devices."""

    address: LineAddress
    runner: TappedRunner
    work: Work = field(init=False)

    def __post_init__(self) -> None:
        """The connection at work."""
        self.work = Work(f"line {self.address.text}", self.runner.run)

    @property
    def stations(self) -> list[Station]:
        """The devices on it."""
        return self.runner.line.stations


class ModbusLines(SharedPart):
    """All lines of the daemon."""

    def __init__(self) -> None:
        self.lines: dict[LineAddress, _LineAtWork] = {}
        self._group = WorkGroup()
        self._tap: Tap | None = None
        self._devices: list[DeviceOnLine] = []

    async def run(self) -> None:
        """Keep all lines at work until cancelled."""
        await self._group.run(lambda: [line.work for line in self.lines.values()])

    def progress(self) -> Mapping[str, int]:
        """Of each line, whatever its devices do."""
        return {
            f"line {address.text}": line.runner.progress + line.work.rests
            for address, line in self.lines.items()
        }

    def troubles(self) -> Sequence[str]:
        """Devices that end the connection after each answer: they are lost again and again, and nobody sees why."""
        return [
            f"{address.text}: the device closes the connection after each answer; "
            f"set `connect: per_request` at {names_and_more(self._names(address))}"
            for address, line in self.lines.items()
            if line.runner.line.closes_after_answer
        ]

    def _names(self, address: LineAddress) -> list[str]:
        return [device.plan.name for device in self._devices if device.plan.line == address]

    def gap(self, since: float, now: float) -> None:
        """The process stood still: that is no silence of any device."""
        for line in self.lines.values():
            line.runner.line.gap(now - since)

    def trace(self, tap: Tap | None) -> None:
        """All frames of all lines."""
        self._tap = tap
        for line in self.lines.values():
            line.runner.tap = tap

    async def prepare(self, plans: Sequence[Plan]) -> Prepared:
        """Nothing: a device that cannot be reached keeps no mapping from being served."""
        return NothingPrepared()

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Have a line for every address of these devices, and no other; each with its devices and no others."""
        wanted: dict[LineAddress, list[DeviceOnLine]] = {}
        self._devices = [cast("DeviceOnLine", link) for link in links]
        for device in self._devices:
            wanted.setdefault(device.plan.line, []).append(device)
        for address, line in list(self.lines.items()):
            if address not in wanted or line.runner.line.settings != settings_of(wanted[address]):
                self._remove_all(line)
                line.work.end()
                del self.lines[address]
        for address, devices in wanted.items():
            if address not in self.lines:
                self.lines[address] = line = self._line(address, settings_of(devices))
                self._group.begin(line.work)
                for device in devices:
                    device.begin_anew()
            self._put(self.lines[address], [device.station for device in devices])

    async def close(self) -> None:
        """Ask nobody any more."""
        for device in self._devices:
            device.stop()
        lines = list(self.lines.values())
        self.lines.clear()
        for line in lines:
            self._remove_all(line)
        await end_all(line.work for line in lines)

    def _line(self, address: LineAddress, settings: LineSettings) -> _LineAtWork:
        def report(reason: str) -> None:
            if reason:
                log.warning("no connection to devices", extra=fields(line=address.text, reason=reason))
            else:
                log.info("connected to devices", extra=fields(line=address.text))

        runner = make_runner(address, Line(settings), report)
        runner.tap, runner.peer = self._tap, address.text
        runner.is_rtu = address.serial is not None or address.framing == "rtu"
        runner.concerned = lambda unit: self._concerned(address, unit)
        return _LineAtWork(address, runner)

    def _concerned(self, address: LineAddress, unit: int) -> Concerned:
        """The devices of this unit; of one that nobody has declared, all devices of the line."""
        found = [device for device in self._devices if device.plan.line == address]
        of_unit = [device for device in found if device.plan.unit == unit]
        return concerned_by([device.device_id for device in of_unit or found])

    @staticmethod
    def _remove_all(line: _LineAtWork) -> None:
        for station in list(line.stations):
            line.runner.remove(station)

    @staticmethod
    def _put(line: _LineAtWork, stations: Sequence[Station]) -> None:
        present = list(line.stations)
        for station in present:
            if station not in stations:
                line.runner.remove(station)
        for station in stations:
            if station not in present:
                line.runner.add(station)


def make_runner(address: LineAddress, line: Line, report: Callable[[str], object]) -> TappedRunner:
    """What keeps a line at work. What serial ports need is imported where there is one."""
    if address.serial is not None:
        from gatewayd.links.devices.modbus.serial_line import serial_runner  # noqa: PLC0415

        return serial_runner(address, line, report)
    frames = TcpFrames.RTU if address.framing == "rtu" else TcpFrames.MODBUS_TCP
    return TappedTcpLine(TcpAddress(address.path, address.port, frames), line, report)


def settings_of(devices: Sequence[DeviceOnLine]) -> LineSettings:
    """What the devices of a line share: as many requests at a time as one of them may have, and so on."""
    plans = [device.plan for device in devices]
    per_request = any(plan.per_request for plan in plans)
    return LineSettings(
        in_flight=1 if per_request else max(plan.in_flight for plan in plans),
        use=ConnectionUse.PER_REQUEST if per_request else ConnectionUse.KEPT,
    )
