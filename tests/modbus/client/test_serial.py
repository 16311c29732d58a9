from __future__ import annotations

import asyncio
import builtins
import fcntl
import os
import pty
import tty
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gatewayd.loop import clock
from gatewayd.modbus.client import pdus
from gatewayd.modbus.client.breaker import BreakerSettings
from gatewayd.modbus.client.line import Line, LineSettings
from gatewayd.modbus.client.requests import write_register
from gatewayd.modbus.client.serial import SerialLine, SerialPort
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.unit import StationSettings, UnitState
from tests.modbus.client.server import running
from tests.modbus.client.test_tcp import until
from tests.modbus.client.world import Heard, Unit, polls

SETTINGS = StationSettings(9, polls(0.005), 0.2, BreakerSettings(lost_after=0.3, probe_every=0.05))


@pytest.fixture
def port() -> Iterator[tuple[int, str]]:
    """The far end of a serial line, and the name of the near one."""
    far, near = pty.openpty()
    tty.setraw(near)
    os.set_blocking(far, False)
    name = os.ttyname(near)
    os.close(near)
    yield far, name
    os.close(far)


def made(name: str) -> tuple[SerialLine, Station, Heard, list[str]]:
    heard, reports = Heard(), list[str]()
    station = Station(SETTINGS, heard)
    line = SerialLine(
        SerialPort(name, 115_200, "none"), Line(LineSettings(max_backoff=0.05), [station]), reports.append
    )
    return line, station, heard, reports


def answer(far: int, unit: Unit) -> None:
    """Serve what is asked at the far end."""
    try:
        frame = os.read(far, 256)
    except OSError:  # nobody has the near end open
        return
    assert pdus.crc(frame[:-2]) == frame[-2:]
    answer = frame[:1] + (unit.answer(frame[1:-2]) or b"")
    os.write(far, answer + pdus.crc(answer))


async def test_values_and_writes_over_a_port(port: tuple[int, str]) -> None:
    far, name = port
    unit = Unit()
    unit.registers[0] = 0x1234
    line, station, heard, reports = made(name)
    asyncio.get_running_loop().add_reader(far, answer, far, unit)
    async with running(line):
        await until(lambda: len(heard.values) > 5, "values")
        assert heard.values[-1][1] == b"\x12\x34\x00\x00"
        station.write("a", write_register(1, b"\x00\x07"), clock.now())
        await until(lambda: heard.written, "the write")
        assert unit.registers[1] == 7
    asyncio.get_running_loop().remove_reader(far)
    assert reports == []


async def test_port_is_for_one_process(port: tuple[int, str]) -> None:
    _, name = port
    other = os.open(name, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(other, fcntl.LOCK_EX)
    line, station, _, reports = made(name)
    async with running(line):
        await until(lambda: reports, "the report")
        assert reports == [f"{name} (115200 8N1): another program uses it"]
        assert station.state is UnitState.LOST
        os.close(other)
        await until(lambda: line.line.is_connected, "the port")


async def test_adapter_that_is_unplugged_is_noticed() -> None:
    far, near = pty.openpty()
    name = os.ttyname(near)
    tty.setraw(near)
    os.set_blocking(far, False)
    line, station, heard, _ = made(name)
    asyncio.get_running_loop().add_reader(far, answer, far, Unit())
    async with running(line):
        await until(lambda: heard.values, "values")
        asyncio.get_running_loop().remove_reader(far)
        os.close(near)
        os.close(far)
        await until(lambda: station.state is UnitState.LOST, "the loss")
        assert name in station.reason


@pytest.mark.parametrize(
    "name, words", [("/dev/no-such-port", "there is no such port"), ("/dev/null", "it is no serial port")]
)
async def test_what_is_wrong_with_a_port_and_the_remedy(name: str, words: str) -> None:
    line, _, _, reports = made(name)
    async with running(line):
        await until(lambda: reports, "the report")
    assert reports[0].startswith(f"{name} (115200 8N1): {words}")


async def test_missing_pyserial_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name == "serial":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    line, _, _, reports = made("/dev/ttyUSB0")
    async with running(line):
        await until(lambda: reports, "the report")
    assert reports == ["/dev/ttyUSB0: pyserial is missing; install gatewayd[serial]"]


def test_characters_of_a_port() -> None:
    assert SerialPort("/dev/ttyS0").bits == 11
    assert SerialPort("/dev/ttyS0", 115_200, "none").bits == 10
    assert SerialPort("/dev/ttyS0", 9600, "odd", 2).timing.gap == pytest.approx(3.5 * 12 / 9600)
    assert Path(str(SerialPort("/dev/ttyS0")).split()[0]) == Path("/dev/ttyS0")
