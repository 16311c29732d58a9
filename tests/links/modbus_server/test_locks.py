"""A lock follows the connection that works with it: over real sockets, what the robot would get."""

from __future__ import annotations

import asyncio
import socket
import struct
import time
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import replace

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value
from gatewayd.links.modbus_server import shares
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent
from gatewayd.links.modbus_server.plan import ModbusPlan
from tests.links.modbus_server.conftest import PLC, bring_up

PlanOf = Callable[..., ModbusPlan]

PLC_ADDRESS = "127.0.0.2"
PART = 10
"""Register of the variable `part`."""
GRACE = 5.0


class Robot:
    """What one variable was, whenever inputs changed."""

    def __init__(self, cell: Cell, variable: int) -> None:
        self.cell = cell
        self.got: list[Value] = [cell.image.values[variable]]
        self._variable = variable
        cell.listeners.append(self._changed)

    @property
    def owner(self) -> int | None:
        return self.cell.ownership.owners[self.cell.definition.variables[self._variable].lock or 0]

    def _changed(self, direction: Direction) -> None:
        value = self.cell.image.values[self._variable]
        if direction is Direction.INPUT and value != self.got[-1]:
            self.got.append(value)


class Client:
    """A connection of the PLC."""

    def __init__(self, listener: ModbusListener) -> None:
        self.socket = socket.create_connection(("127.0.0.1", listener.port), 5, (PLC_ADDRESS, 0))
        self.socket.setblocking(False)

    async def ask(self, function: int, address: int, word: int) -> bytes:
        loop = asyncio.get_running_loop()
        await loop.sock_sendall(self.socket, struct.pack(">HHHBBHH", 1, 0, 6, 1, function, address, word))
        async with asyncio.timeout(5):
            return (await loop.sock_recv(self.socket, 300))[7:]

    async def write(self, value: int) -> None:
        assert await self.ask(6, PART, value) == struct.pack(">BHH", 6, PART, value)

    async def read(self) -> int:
        return int.from_bytes((await self.ask(3, PART, 1))[2:], "big")

    async def ended(self) -> bool:
        async with asyncio.timeout(5):
            return await asyncio.get_running_loop().sock_recv(self.socket, 1) == b""

    def end(self, how: str) -> None:
        if how == "half-closed":
            self.socket.shutdown(socket.SHUT_WR)
            return
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", how == "reset", 0))
        self.socket.close()


@pytest.fixture
def grace() -> float:
    return 0.0


@pytest.fixture
def cell(live_cell: Cell, grace: float) -> Cell:
    definition = live_cell.definition
    writers = tuple(replace(writer, grace=grace) for writer in definition.writers)
    cell = Cell(replace(definition, writers=writers))
    bring_up(cell, time.monotonic())
    cell.freshness.stale_after = 3600.0
    return cell


@pytest.fixture
def robot(cell: Cell, index_of: Callable[[str], int]) -> Robot:
    return Robot(cell, index_of("part"))


@pytest.fixture
async def listener(cell: Cell, plan_of: PlanOf, events: list[PeerEvent]) -> AsyncIterator[ModbusListener]:
    listener = ModbusListener("127.0.0.1", 0, observe=events.append)
    listener.serve([(plan_of(), cell)])
    await listener.start()
    yield listener
    await listener.close()


@pytest.fixture
def connect(listener: ModbusListener) -> Iterator[Callable[[], Client]]:
    clients: list[Client] = []

    def connect() -> Client:
        clients.append(Client(listener))
        return clients[-1]

    yield connect
    for client in clients:
        client.socket.close()


Connect = Callable[[], Client]


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110 - conditions of others have no event
            await asyncio.sleep(0.001)


@pytest.mark.parametrize("end", ["closed", "half-closed", "reset"])
async def test_the_lock_ends_with_the_connection_that_wrote_though_a_reader_lives(
    connect: Connect, cell: Cell, robot: Robot, end: str
) -> None:
    reader, writer = connect(), connect()
    assert await reader.read() == 0
    await writer.write(42)
    assert await reader.read() == 42
    writer.end(end)
    await until(lambda: robot.owner is None)
    assert robot.got == [0, 42, 0]
    assert await reader.read() == 0
    assert cell.writers.alive[PLC], "the reader is the same writer"


async def test_the_end_of_the_connection_that_only_read_releases_nothing(
    connect: Connect, listener: ModbusListener, robot: Robot
) -> None:
    reader, writer = connect(), connect()
    assert await reader.read() == 0
    await writer.write(42)
    reader.end("closed")
    await until(lambda: listener.connections == 1)
    assert await writer.read() == 42
    assert robot.got == [0, 42]


async def test_the_lock_moves_to_the_connection_that_writes_next(
    connect: Connect, listener: ModbusListener, robot: Robot
) -> None:
    """A client that connects anew before it notices that its former connection is dead."""
    former, present = connect(), connect()
    await former.write(41)
    await present.write(42)
    former.end("reset")
    await until(lambda: listener.connections == 1)
    assert robot.got == [0, 41, 42]
    assert robot.owner == PLC


async def _write_and_connect_anew(connect: Connect, listener: ModbusListener) -> None:
    former = connect()
    await former.write(42)
    former.end("closed")
    await until(lambda: listener.connections == 0)
    await asyncio.sleep(0.002)
    await connect().write(42)


async def test_without_grace_a_client_that_connects_anew_pulses(
    connect: Connect, listener: ModbusListener, robot: Robot
) -> None:
    await _write_and_connect_anew(connect, listener)
    assert robot.got == [0, 42, 0, 42]


@pytest.mark.parametrize("grace", [GRACE])
async def test_with_grace_the_value_stays_while_its_client_connects_anew(
    connect: Connect, listener: ModbusListener, robot: Robot
) -> None:
    await _write_and_connect_anew(connect, listener)
    assert robot.got == [0, 42]


@pytest.mark.parametrize("grace", [0.1])
async def test_after_its_grace_the_value_falls_back(
    connect: Connect, listener: ModbusListener, cell: Cell, robot: Robot
) -> None:
    """With a reader of the same writer there or without."""
    reader, writer = connect(), connect()
    assert await reader.read() == 0
    for last in (False, True):
        await writer.write(42)
        if last:
            reader.end("closed")
            await until(lambda: listener.connections == 1)
        writer.end("closed")
        await until(lambda last=last: listener.connections == 1 - last)  # type: ignore[misc]
        cell.tick(time.monotonic())
        assert robot.got[-1] == 42
        cell.tick(time.monotonic() + 0.2)
        assert robot.got[-1] == 0
        writer = connect()
    assert robot.got == [0, 42, 0, 42, 0]


async def test_idleness_ends_the_connections_that_hold_nothing_whoever_else_does(
    connect: Connect, listener: ModbusListener, cell: Cell, plan_of: PlanOf, robot: Robot
) -> None:
    listener.serve([(plan_of(idle_timeout=0.1), cell)])
    reader, writer = connect(), connect()
    assert await reader.read() == 0
    await writer.write(42)
    assert await reader.ended()
    await asyncio.sleep(0.3)
    assert robot.got == [0, 42]
    assert await writer.read() == 42


async def test_room_is_made_by_the_connections_that_hold_nothing_whoever_else_does(
    connect: Connect,
    listener: ModbusListener,
    cell: Cell,
    plan_of: PlanOf,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(shares, "UNUSED_AFTER", 0.0)
    listener.serve([(plan_of(connections=3), cell)])
    writer, reader = connect(), connect()
    await writer.write(42)
    assert await reader.read() == 42
    assert await connect().read() == 42
    assert await reader.ended()
    assert await connect().read() == 42
    assert await writer.read() == 42


async def test_a_reload_leaves_the_lock_with_its_connection(
    connect: Connect, listener: ModbusListener, cell: Cell, plan_of: PlanOf, robot: Robot
) -> None:
    reader, writer = connect(), connect()
    assert await reader.read() == 0
    await writer.write(42)
    listener.serve([(plan_of(), cell)])
    assert await writer.read() == 42
    writer.end("closed")
    await until(lambda: robot.owner is None)
    assert robot.got == [0, 42, 0]
