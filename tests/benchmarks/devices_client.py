"""One client process of the benchmark `devices`; prints `polls seconds cpu`, counted after a warm-up.

Usage: devices_client.py gatewayd|pymodbus PORT REGISTERS PERIOD_MS IN_FLIGHT WARMUP SECONDS UNIT...
Counted are polls of the units 1 to 32: the others do not answer.
"""

from __future__ import annotations

import asyncio
import logging
import os
import resource
import sys
import time
from collections.abc import Callable, Coroutine, Hashable

from pymodbus.client import AsyncModbusTcpClient
from pymodbus.exceptions import ModbusException

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.grouping import ReadGroup, WantedItem, plan_classes
from gatewayd.modbus.client.identity import UnitIdentity
from gatewayd.modbus.client.line import Line, LineSettings
from gatewayd.modbus.client.requests import Failure
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.tcp import TcpAddress, TcpLine
from gatewayd.modbus.client.unit import StationSettings, UnitState

HOST = "127.0.0.1"
TIMEOUT = 0.3
ANSWERING = 32


class _Counting:
    """Counts what was read."""

    def __init__(self) -> None:
        self.polls = 0

    def values_read(self, group: ReadGroup, data: bytes, now: float) -> None:
        self.polls += 1

    def read_failed(self, group: ReadGroup, failure: Failure, now: float) -> None:
        pass

    def write_done(self, key: Hashable, failure: Failure | None, now: float) -> None:
        pass

    def state_changed(self, state: UnitState, reason: str, now: float) -> None:
        pass

    def connection_renewed(self, now: float) -> None:
        pass

    def identified(self, identity: UnitIdentity, former: UnitIdentity | None, now: float) -> None:
        pass


def _cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


Job = tuple[Coroutine[object, object, None], Callable[[], int]]
"""What polls, and how many answers there were."""


def _gatewayd(port: int, registers: int, period: float, in_flight: int, units: list[int]) -> Job:
    counting = _Counting()
    polls = plan_classes([WantedItem(Area.HOLDING, 0, registers)], [period])
    stations = [
        Station(StationSettings(unit, polls, TIMEOUT, in_flight=in_flight), counting) for unit in units
    ]
    line = Line(LineSettings(in_flight=in_flight), stations)
    return TcpLine(TcpAddress(HOST, port), line).run(), lambda: counting.polls


def _pymodbus(port: int, registers: int, period: float, _in_flight: int, units: list[int]) -> Job:
    """The loop that its documentation suggests: one unit after the other, no retries."""
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    polls = 0

    async def poll() -> None:
        nonlocal polls
        client = AsyncModbusTcpClient(HOST, port=port, timeout=TIMEOUT, retries=0, reconnect_delay=0.1)
        await client.connect()
        due = time.monotonic()
        while True:
            for unit in units:
                try:
                    answer = await client.read_holding_registers(0, count=registers, device_id=unit)
                except ModbusException:
                    if not client.connected:
                        await client.connect()
                    continue
                polls += not answer.isError() and unit <= ANSWERING
            due += period
            if period:
                await asyncio.sleep(max(0.0, due - time.monotonic()))

    return poll(), lambda: polls


async def _main() -> None:
    name, port, registers, period, in_flight, warmup, seconds, *units = sys.argv[1:]
    make = {"gatewayd": _gatewayd, "pymodbus": _pymodbus}[name]
    numbers = [int(unit) for unit in units]
    work, count = make(int(port), int(registers), float(period) / 1000, int(in_flight), numbers)
    task = asyncio.ensure_future(work)
    await asyncio.sleep(float(warmup))
    before, start, used = count(), time.monotonic(), _cpu()
    await asyncio.sleep(float(seconds))
    print(count() - before, time.monotonic() - start, _cpu() - used, flush=True)
    assert not task.done()
    os._exit(0)  # a client of pymodbus that waits for an answer survives its cancellation


if __name__ == "__main__":
    asyncio.run(_main())
