"""The client with servers that others wrote: three units behind one connection, of which one goes wrong.

What is asserted is how often the others are read, in comparison with the same seconds of the same machine without a
fault: the machine may be busy.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from gatewayd.loop import clock
from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.breaker import BreakerSettings
from gatewayd.modbus.client.grouping import WantedItem, plan_classes
from gatewayd.modbus.client.line import Line, LineSettings
from gatewayd.modbus.client.requests import (
    mask_register,
    read_write,
    write_coils,
    write_register,
    write_registers,
)
from gatewayd.modbus.client.runner import LineRunner
from gatewayd.modbus.client.serial import SerialLine, SerialPort
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.tcp import TcpAddress, TcpLine
from gatewayd.modbus.client.unit import StationSettings, UnitState
from gatewayd.modbus.client.writes import PartWrite, WriteOrder
from tests.e2e.processes import HOST
from tests.modbus.client.server import running
from tests.modbus.client.test_tcp import until
from tests.modbus.client.world import Heard
from tests.peers.programs import PROGRAMS, Proxy, fault_proxy, libmodbus_server, serial_bus, tcp_server

pytestmark = pytest.mark.slow

TIMEOUT = 0.1
BREAKER = BreakerSettings(failures=3, lost_after=0.6, probe_every=0.3)
WINDOW = 0.5
"""Seconds in which polls are counted."""
TRIES = 5
WANTED = [WantedItem(Area.HOLDING, 10, 4), WantedItem(Area.COIL, 3, 5)]


class Units:
    """The stations of a line, and what they have reported."""

    def __init__(self, numbers: tuple[int, ...], period: float, timeout: float = TIMEOUT) -> None:
        self.heard = {number: Heard() for number in numbers}
        polls = plan_classes(WANTED, [period] * len(WANTED))
        self.stations = {
            number: Station(StationSettings(number, polls, timeout, BREAKER), heard)
            for number, heard in self.heard.items()
        }

    def line(self, in_flight: int = 1) -> Line:
        settings = LineSettings(in_flight=in_flight, max_backoff=0.1, probe_share=0.1)
        return Line(settings, self.stations.values())

    def are(self, state: UnitState, *numbers: int) -> Callable[[], bool]:
        return lambda: all(self.stations[number].state is state for number in numbers or self.stations)

    def count(self, *numbers: int) -> int:
        return sum(len(self.heard[number].values) for number in numbers)

    async def rate(self, *numbers: int) -> float:
        """Groups read in a second."""
        before, start = self.count(*numbers), clock.now()
        await asyncio.sleep(WINDOW)
        return (self.count(*numbers) - before) / (clock.now() - start)


@pytest.fixture(params=PROGRAMS)
def server(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[str, int]]:
    """A foreign server with three units: its name and port."""
    name: str = request.param
    with tcp_server(name, PROGRAMS[name](tmp_path), tmp_path) as port:
        yield name, port


async def test_faults_of_one_unit_are_its_own(server: tuple[str, int], tmp_path: Path) -> None:
    """libmodbus answers one request after the other, and is asked so; the other one takes all three at a time."""
    name, port = server
    units = Units((1, 2, 3), 0.02)
    in_flight = 1 if name == "libmodbus" else 3
    with fault_proxy(port, 2, tmp_path) as proxy:
        line = TcpLine(TcpAddress(HOST, proxy.port), units.line(in_flight))
        async with running(line):
            await until(units.are(UnitState.ONLINE), "all units")
            for fault in ("drop", f"delay {3 * TIMEOUT}", "truncate", "garble"):
                attempts = [await _attempt(units, proxy, fault)]
                while not attempts[-1].is_good and len(attempts) < TRIES:
                    attempts.append(await _attempt(units, proxy, fault))
                assert attempts[-1].is_good, f"{fault}: {attempts}"
    counters = units.stations[2].counters
    assert counters.time_outs >= 3
    assert counters.late_answers > 0


class Attempt(NamedTuple):
    """The other units before and with a fault of one. On a machine that is busy everybody may be late once."""

    healthy: float
    with_fault: float
    losses: int

    @property
    def is_good(self) -> bool:
        return self.with_fault > 0.8 * self.healthy and not self.losses


async def _attempt(units: Units, proxy: Proxy, fault: str) -> Attempt:
    others = [units.stations[number].counters for number in (1, 3)]
    losses = sum(one.losses for one in others)
    healthy = await units.rate(1, 3)
    proxy.order(fault)
    start = clock.now()
    await until(units.are(UnitState.LOST, 2), f"the loss by {fault}")
    # Three time-outs and what lies between them; a garbled answer may be right by chance.
    assert clock.now() - start < 5.0
    with_fault = await units.rate(1, 3)
    proxy.order("ok")
    await until(units.are(UnitState.ONLINE), f"recovery from {fault}")
    return Attempt(healthy, with_fault, sum(one.losses for one in others) - losses)


async def test_every_function_that_writes(server: tuple[str, int]) -> None:
    units = Units((1, 2, 3), 0.02)
    station, heard = units.stations[2], units.heard[2]
    line = TcpLine(TcpAddress(HOST, server[1]), units.line())
    async with running(line):
        await until(units.are(UnitState.ONLINE), "all units")
        orders: list[tuple[str, WriteOrder]] = [
            ("FC 6", write_register(10, b"\x12\x34")),
            ("FC 16", write_registers(11, b"\x00\x01\x00\x02")),
            ("FC 15", write_coils(3, (True, False, True, True, False))),
            ("part", PartWrite(10, 0x00FF, 0x0099)),
        ]
        for key, order in orders:
            assert station.write(key, order, clock.now())
        await until(lambda: len(heard.written) == len(orders), "the writes")
        assert dict(heard.written) == {key: None for key, _ in orders}
        heard.values.clear()
        await until(lambda: len(heard.values) > 3, "values")
    found = {group.area: data for group, data in heard.values}
    assert found == {Area.HOLDING: bytes.fromhex("129900010002000d"), Area.COIL: b"\x0d"}
    assert {group.area: data for group, data in units.heard[1].values}[
        Area.HOLDING
    ].hex() == "000a000b000c000d"


async def test_functions_22_and_23_of_libmodbus(tmp_path: Path) -> None:
    units = Units((1,), 0.02)
    with tcp_server("libmodbus", libmodbus_server(tmp_path), tmp_path) as port:
        line = TcpLine(TcpAddress(HOST, port), units.line())
        async with running(line):
            await until(units.are(UnitState.ONLINE), "the unit")
            station, heard = units.stations[1], units.heard[1]
            station.write("FC 22", mask_register(10, 0xFF00, 0x0077), clock.now())
            station.write("FC 23", read_write(10, 4, 12, b"\x00\x63"), clock.now())
            await until(lambda: len(heard.written) == 2, "the writes")
            assert dict(heard.written) == {"FC 22": None, "FC 23": None}
            heard.values.clear()
            await until(lambda: len(heard.values) > 3, "values")
            assert {group.area: data for group, data in heard.values}[
                Area.HOLDING
            ].hex() == "0077000b0063000d"


async def test_serial_line_with_two_units_and_one_that_is_not_there(tmp_path: Path) -> None:
    units = Units((4, 5, 6), 0.02)
    program = libmodbus_server(tmp_path)
    with serial_bus(program, (4, 6), 115_200, tmp_path) as bus:
        line: LineRunner = SerialLine(SerialPort(bus.names[0], 115_200, "none"), units.line())
        async with running(line):
            await until(units.are(UnitState.ONLINE, 4, 6), "the units that are there")
            await until(units.are(UnitState.LOST, 5), "the loss of the other")
            assert units.heard[6].values[0][1].hex() in ("000a000b000c000d", "00")
            units.stations[6].write("a", write_register(10, b"\x12\x34"), clock.now())
            await until(lambda: units.heard[6].written == [("a", None)], "the write")
            # A probe of the unit that is not there has libmodbus's servers lose the thread now and then.
            rates = [await units.rate(4, 6)]
            while rates[-1] <= 20 and len(rates) < TRIES:
                rates.append(await units.rate(4, 6))
            assert rates[-1] > 20, rates
            bus.is_cut = True
            await until(units.are(UnitState.LOST), "the loss of all")
            bus.is_cut = False
            await until(units.are(UnitState.ONLINE, 4, 6), "recovery")
