from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable

import pytest

from gatewayd.loop import clock
from gatewayd.modbus.client import pdus
from gatewayd.modbus.client.breaker import BreakerSettings
from gatewayd.modbus.client.line import ConnectionUse, Line, LineSettings
from gatewayd.modbus.client.requests import write_register
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.tcp import TcpAddress, TcpFrames, TcpLine
from gatewayd.modbus.client.unit import StationSettings, UnitState
from tests.modbus.client.server import HOST, PATIENCE, running, serving
from tests.modbus.client.world import Heard, Unit, polls

SETTINGS = StationSettings(1, polls(0.005), 0.2, BreakerSettings(lost_after=0.3, probe_every=0.05))


async def until(condition: Callable[[], object], what: str) -> None:
    end = clock.now() + PATIENCE
    while not condition():
        assert clock.now() < end, f"waited in vain for {what}"
        await asyncio.sleep(0.001)


def made(
    port: int, settings: LineSettings | None = None, station: StationSettings = SETTINGS, **address: TcpFrames
) -> tuple[TcpLine, Station, Heard, list[str]]:
    heard, reports = Heard(), list[str]()
    own = Station(station, heard)
    line = Line(settings or LineSettings(max_backoff=0.05), [own])
    return TcpLine(TcpAddress(HOST, port, **address), line, reports.append), own, heard, reports


async def test_values_and_writes_over_a_socket() -> None:
    async with serving() as server:
        server.unit.registers[0] = 0x1234
        line, station, heard, reports = made(server.port)
        async with running(line):
            await until(lambda: len(heard.values) > 5, "values")
            assert heard.values[-1][1] == b"\x12\x34\x00\x00"
            assert station.write("a", write_register(1, b"\x00\x07"), clock.now())
            await until(lambda: heard.written, "the write")
            assert server.unit.registers[1] == 7
            channel = line._channel
            assert channel is not None
            connection = channel._transport.get_extra_info("socket")  # type: ignore[attr-defined]
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
            assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
            assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 3000
            progress = line.progress
            await until(lambda: line.progress > progress, "progress")
    assert reports == []
    assert heard.states[-1][:2] == (UnitState.LOST, "the line was stopped")


async def test_connection_is_opened_again_without_a_loss() -> None:
    async with serving() as server:
        line, _station, heard, reports = made(server.port)
        async with running(line):
            for _ in range(5):
                heard.values.clear()
                await until(lambda: heard.values, "values")
                before = server.accepted
                server.drop()
                await until(lambda: server.accepted > before, "another connection")  # noqa: B023 - waited for here
            heard.values.clear()
            await until(lambda: heard.values, "values")
            assert [state for state, _, _ in heard.states] == [UnitState.ONLINE]
    assert reports == []


async def test_server_that_is_away_and_comes_back() -> None:
    async with serving() as server:
        line, station, _heard, reports = made(server.port)
        async with running(line):
            await until(lambda: station.state is UnitState.ONLINE, "values")
            await server.stop()
            await until(lambda: station.state is UnitState.LOST, "the loss")
            assert station.reason == f"{HOST}:{server.port}: Connection refused"
            await server.start()
            await until(lambda: station.state is UnitState.ONLINE, "values")
    assert reports == [f"{HOST}:{server.port}: Connection refused", ""]


async def test_device_that_closes_after_each_answer_is_polled_all_the_same() -> None:
    async with serving() as server:
        server.closes_after = 1
        line, station, heard, _ = made(server.port)
        async with running(line):
            await until(lambda: len(heard.values) > 20, "values")
            assert station.state is UnitState.ONLINE
            assert server.accepted >= 20


async def test_one_connection_for_each_request() -> None:
    async with serving() as server:
        line, station, heard, _ = made(server.port, LineSettings(use=ConnectionUse.PER_REQUEST))
        async with running(line):
            await until(lambda: len(heard.values) > 20, "values")
            assert server.accepted in range(station.counters.answers, station.counters.requests + 2)


async def test_device_that_says_no_modbus_is_left_and_asked_again() -> None:
    async with serving() as server:
        line, station, _heard, _ = made(server.port)
        async with running(line):
            await until(lambda: station.state is UnitState.ONLINE, "values")
            server.unit.change = lambda pdu: pdu + bytes(300)
            await until(lambda: station.state is UnitState.LOST, "the loss")
            server.unit.change = lambda pdu: pdu
            await until(lambda: station.state is UnitState.ONLINE, "values")


async def test_rtu_over_tcp() -> None:
    unit = Unit()
    unit.registers[1] = 0x4321

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while frame := await reader.read(256):
            assert pdus.crc(frame[:-2]) == frame[-2:]
            answer = frame[:1] + (unit.answer(frame[1:-2]) or b"")
            writer.write(b"\xff" + answer[:3])
            await asyncio.sleep(0)
            writer.write(answer[3:] + pdus.crc(answer))

    server = await asyncio.start_server(serve, HOST, 0)
    async with server:
        port = server.sockets[0].getsockname()[1]
        line, _station, heard, _ = made(port, frames=TcpFrames.RTU)
        async with running(line):
            await until(lambda: len(heard.values) > 5, "values")
            assert heard.values[-1][1] == b"\x00\x00\x43\x21"


@pytest.mark.parametrize("host", ["no-such-host.invalid", "a" * 300])
async def test_name_that_has_no_address_is_said(host: str) -> None:
    heard, reports = Heard(), list[str]()
    line = TcpLine(TcpAddress(host), Line(LineSettings(), [Station(SETTINGS, heard)]), reports.append)
    async with running(line):
        await until(lambda: heard.states, "the loss")
    assert heard.states[0][0] is UnitState.LOST
    assert "has no address" in reports[0]


async def test_connection_that_does_not_come_is_given_up() -> None:
    """A listener whose queue is full answers nothing to further SYNs."""
    with socket.socket() as listener:
        listener.bind((HOST, 0))
        listener.listen(0)
        port = listener.getsockname()[1]
        fillers = [socket.socket() for _ in range(4)]
        for filler in fillers:
            filler.setblocking(False)
            filler.connect_ex((HOST, port))
        line, _, _heard, reports = made(port, LineSettings(connect_timeout=0.05, max_backoff=0.05))
        async with running(line):
            await until(lambda: reports, "the report")
        for filler in fillers:
            filler.close()
    assert reports == ["no connection within 0.05 s"]


async def test_units_may_be_added_and_removed_while_it_runs() -> None:
    async with serving() as server:
        line, station, heard, _ = made(server.port)
        other = Heard()
        async with running(line):
            await until(lambda: heard.values, "values")
            line.remove(station)
            heard.values.clear()
            added = Station(SETTINGS, other)
            line.add(added)
            await until(lambda: other.values, "values of the other")
            assert heard.values == []
            line.remove(added)
            line.add(Station(SETTINGS, heard))
            await until(lambda: heard.values, "values")
