"""Modbus devices without a gateway: who answers on a line, and a place of one device.

A scan reads holding register 0 of each unit, because any answer shows that it is there, an exception too. Then those
that are there are asked for their identification. Servers made with libmodbus are known to need some care:

- they wait for half a second before they refuse a function that they do not know, and drop all that comes meanwhile, so
  the identification has more time;
- on a serial line they take what follows a request to another unit for its answer, so a silent unit is asked twice.

Where a device breaks the connection over a unit that it has not, the scan goes on with a new one.
"""

from __future__ import annotations

import asyncio
import os.path
from collections.abc import AsyncIterator, Hashable, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from typing import Final

from gatewayd.core.definition import CellDefinition
from gatewayd.links.access import (
    AccessError,
    AccessProblem,
    DeviceAccess,
    FoundDevice,
    PlaceAnswer,
    PlaceRequest,
    Scan,
    ScanOrder,
)
from gatewayd.links.devices.asking import RunningDevice, running_devices
from gatewayd.links.devices.modbus.asking import ask_place, exchange
from gatewayd.links.devices.modbus.lines import make_runner
from gatewayd.links.devices.modbus.plan import LineAddress, ModbusDevicePlan, SerialSettings
from gatewayd.links.devices.scalars import Target
from gatewayd.links.examination import RunningCell
from gatewayd.mapping.plan import LinkPlan
from gatewayd.mapping.tables import read
from gatewayd.mapping.typed import Invalid
from gatewayd.modbus.client.breaker import BreakerSettings
from gatewayd.modbus.client.grouping import ReadGroup
from gatewayd.modbus.client.identity import UnitIdentity
from gatewayd.modbus.client.line import Line, LineSettings
from gatewayd.modbus.client.requests import Failure
from gatewayd.modbus.client.runner import LineRunner
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.unit import StationSettings, UnitState

DEFAULT_TIMEOUT: Final = 0.2
"""Seconds for each unit that a scan asks; what its bytes take on a serial line comes on top."""
_IDENTIFICATION: Final = 1.0
"""Seconds for an answer with the identification, at least."""
_SERIAL_UNITS: Final = range(1, 248)
_TCP_UNITS: Final = range(256)
_CONNECT: Final = 3.0
_LIMIT: Final = 20.0
"""Seconds for all that one unit says of itself."""
_QUIET: Final = 3600.0
_NAMES: Final = {0: "vendor", 1: "product_code", 2: "revision", 3: "url", 4: "product", 5: "model"}


class ModbusScan(Scan):
    """The units of one line."""

    asked = "holding register 0 and the identification (function 43)"
    noun = "unit"

    def __init__(self, address: LineAddress, units: range, timeout: float) -> None:
        self.line = address.text
        self.numbers = units
        self._attempts = 2 if address.framing == "rtu" else 1
        self.longest = _CONNECT + len(units) * timeout * self._attempts
        self._address = address
        self._timeout = timeout

    def refusal(self, running: Sequence[RunningCell]) -> str:
        """A serial port belongs to one process."""
        for device in _on_line(self._address, running):
            if self._address.is_serial:
                return (
                    f"{device.words} has {self._address.path} open: stop that gateway first, or ask one device through "
                    f"it: gatewayd devices read {device.name} holding:0"
                )
        return ""

    def remarks(self, running: Sequence[RunningCell]) -> Sequence[str]:
        """Somebody else has a connection already."""
        return [
            f"{device.words} is connected there as well: what takes one connection only does not answer to this one"
            for device in _on_line(self._address, running)
        ][:1]

    async def run(self) -> AsyncIterator[FoundDevice | int]:
        """See Scan. First who is there, then who they are."""
        present: list[int] = []
        async for visit in self._visits(self._wanted(present)):
            unit = visit.station.settings.unit
            if visit.station.settings.is_identified:
                yield found_device(unit, visit.identity or UnitIdentity())
                continue
            if visit.is_there:
                present.append(unit)
            yield unit - self.numbers[0] + 1

    def _wanted(self, present: Sequence[int]) -> Iterator[StationSettings]:
        """What is asked; `present` grows meanwhile."""
        breaker = BreakerSettings(failures=1, lost_after=_QUIET)
        for unit in self.numbers:
            for _ in range(self._attempts):
                yield StationSettings(unit, timeout=self._timeout, breaker=breaker, keepalive=_QUIET)
                if unit in present:
                    break
        patience = max(self._timeout, _IDENTIFICATION)
        for unit in present:
            yield StationSettings(
                unit, timeout=patience, breaker=breaker, is_identified=True, keepalive=_QUIET
            )

    async def _visits(self, units: Iterator[StationSettings]) -> AsyncIterator[_Visit]:
        """One unit after the other. AccessError where there is no connection at all."""
        following, broken = next(units, None), False
        while following is not None:
            async with _running(self._address) as runner:
                while following is not None:
                    visit = _Visit(following)
                    await visit.begun(runner)
                    if not runner.line.connections:
                        raise AccessError(AccessProblem.UNUSABLE, runner.line.trouble)
                    # Whose fault the end of a connection is shows when the unit is the first on the next.
                    broken = not (runner.line.is_connected or broken or visit.is_there)
                    if broken:
                        break
                    yield visit
                    runner.remove(visit.station)
                    following = next(units, None)
                    if not runner.line.is_connected:
                        break


def found_device(unit: int, identity: UnitIdentity) -> FoundDevice:
    """A unit as its identification describes it."""
    known = dict(identity.objects)
    text = " ".join(filter(None, (known.get(number, "").strip() for number in (0, 4, 1, 5, 2))))
    fields = {name: known.get(number) for number, name in _NAMES.items()}
    return FoundDevice(unit, text, fields)


class _Visit:
    """One unit, asked until it has said who it is or is given up: the listener of its station."""

    def __init__(self, settings: StationSettings) -> None:
        self.identity: UnitIdentity | None = None
        self.reason = ""
        self.station = Station(settings, self)
        self._ends_when_there = not settings.is_identified
        self._ended = asyncio.Event()

    @property
    def is_there(self) -> bool:
        """Whether the unit answers."""
        return self.station.state is UnitState.ONLINE

    async def begun(self, runner: LineRunner) -> None:
        """Put it on the line, and wait until it is known to be there or not."""
        runner.add(self.station)
        with suppress(TimeoutError):
            async with asyncio.timeout(_LIMIT):
                await self._ended.wait()

    def state_changed(self, state: UnitState, reason: str, now: float) -> None:
        """See StationListener."""
        self.reason = reason
        if state is UnitState.LOST or self._ends_when_there:
            self._ended.set()

    def connection_renewed(self, now: float) -> None:
        """See StationListener."""

    def identified(self, identity: UnitIdentity, former: UnitIdentity | None, now: float) -> None:
        """See StationListener."""
        self.identity = identity
        self._ended.set()

    def values_read(self, group: ReadGroup, data: bytes, now: float) -> None:
        """See StationListener: nothing is polled."""

    def read_failed(self, group: ReadGroup, failure: Failure, now: float) -> None:
        """See StationListener: nothing is polled."""

    def write_done(self, key: Hashable, failure: Failure | None, now: float) -> None:
        """See StationListener: nothing is written by key."""


class ModbusAccess(DeviceAccess):
    """Lines by TCP and on serial ports."""

    settings = ("baudrate", "parity", "stop_bits", "framing")

    def scan(self, order: ScanOrder) -> ModbusScan:
        """See DeviceAccess."""
        address = line_of(order.line, order.settings)
        allowed = _SERIAL_UNITS if address.is_serial else _TCP_UNITS
        first = order.first if order.first is not None else _SERIAL_UNITS[0]
        last = order.last if order.last is not None else _SERIAL_UNITS[-1]
        if not (first in allowed and last in allowed and first <= last):
            raise AccessError(
                AccessProblem.BAD_PLACE,
                f"{first}..{last} are no units of {address.text}: they go from {allowed[0]} to {allowed[-1]}",
            )
        timeout = order.timeout if order.timeout is not None else DEFAULT_TIMEOUT
        return ModbusScan(address, range(first, last + 1), timeout)

    def refusal(self, plan: LinkPlan, running: Sequence[RunningCell]) -> str:
        """A device has one master at a time."""
        assert isinstance(plan, ModbusDevicePlan)
        for device in _on_line(plan.line, running):
            if plan.line.is_serial or device.status.get("unit") == plan.unit:
                return f"{device.words} talks to it already: ask through that gateway, without --mapping"
        return ""

    async def ask(self, plan: LinkPlan, cell: CellDefinition, request: PlaceRequest) -> PlaceAnswer:
        """See DeviceAccess."""
        assert isinstance(plan, ModbusDevicePlan)
        settings = StationSettings(
            plan.unit,
            timeout=plan.timeout,
            breaker=BreakerSettings(failures=plan.failures, lost_after=_QUIET),
            keepalive=_QUIET,
        )
        async with _running(plan.line) as runner:
            visit = _Visit(settings)
            await visit.begun(runner)
            if not visit.is_there:
                problem = AccessProblem.NO_ANSWER if runner.line.connections else AccessProblem.UNUSABLE
                reason = visit.reason or runner.line.trouble
                raise AccessError(
                    problem, f"device {plan.name} does not answer at {plan.line.text}: {reason}"
                )
            return await ask_place(plan, cell, request, lambda each: exchange(visit.station, each, _LIMIT))


def line_of(text: str, settings: Mapping[str, object]) -> LineAddress:
    """The line that somebody has named: a serial port by its path, anything else is a host. Raises AccessError."""
    if text.startswith("/"):
        if settings.get("framing") is not None:
            raise AccessError(
                AccessProblem.BAD_PLACE, f"{text} is a serial port, which has RTU frames: no --framing"
            )
        baudrate = int(str(settings.get("baudrate") or 19_200))
        parity = str(settings.get("parity") or "none")
        stop_bits = int(str(settings.get("stop_bits") or 1))
        return LineAddress(text, framing="rtu", serial=SerialSettings(baudrate, parity, stop_bits))
    given = [name for name in ("baudrate", "parity", "stop_bits") if settings.get(name) is not None]
    if given:
        raise AccessError(
            AccessProblem.BAD_PLACE,
            f"{text} is no serial port, which would begin with /: no --{given[0].replace('_', '-')}",
        )
    try:
        target = read(Target, text)
    except Invalid as invalid:
        context = invalid.mistakes[0].context
        raise AccessError(
            AccessProblem.BAD_PLACE, f"{context.get('message', text)}: {context.get('hint', '')}"
        ) from None
    return LineAddress(target.host, target.port, str(settings.get("framing") or "tcp"))


@asynccontextmanager
async def _running(address: LineAddress) -> AsyncIterator[LineRunner]:
    """A line at work while the context lasts."""
    runner = make_runner(address, Line(LineSettings(connect_timeout=_CONNECT)), lambda _reason: None)
    task = asyncio.create_task(runner.run())
    try:
        yield runner
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


def _on_line(address: LineAddress, running: Sequence[RunningCell]) -> Iterator[RunningDevice]:
    """Devices of running gateways at the same address, however a serial port is called."""
    for device in running_devices(running, ModbusDevicePlan.family):
        where = str(device.status.get("address", ""))
        if address.is_serial:
            path = where.partition(" ")[0]
            if path.startswith("/") and os.path.realpath(path) == os.path.realpath(address.path):
                yield device
        elif where == address.text:
            yield device


ACCESS: Final = ModbusAccess()
"""Talks to devices of this family."""
