"""The dashboard server of the simulator on its socket, and on the command line."""

from __future__ import annotations

import asyncio

import pytest

from gatewayd.simulator.control import Control
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.dashboard import GREETING, PolyScope
from gatewayd.simulator.dashboard_server import MAX_CONNECTIONS, DashboardServer
from gatewayd.simulator.server import SimulatedController


async def read(reader: asyncio.StreamReader) -> str:
    """The next line."""
    async with asyncio.timeout(5):
        return (await reader.readline()).decode().strip()


async def is_cut(reader: asyncio.StreamReader) -> bool:
    """Whether the connection ends without another line."""
    try:
        return not await read(reader)
    except ConnectionError:
        return True


async def test_lines_are_answered_in_order_until_quit() -> None:
    simulator = SimulatedController()
    simulator.dashboard = DashboardServer(PolyScope(simulator.controller))
    async with simulator:
        reader, writer = await asyncio.open_connection("127.0.0.1", simulator.dashboard.port)
        assert await read(reader) == GREETING
        writer.write(b"robotmode\nsafety")
        writer.write(b"status\r\nquit\n")
        assert [await read(reader) for _ in range(4)] == [
            "Robotmode: RUNNING", "Safetystatus: NORMAL", "Disconnected", "",
        ]  # fmt: skip
        writer.close()
        assert not simulator.dashboard.clients


async def test_too_many_connections_and_endless_lines_are_cut() -> None:
    server = DashboardServer(PolyScope(Controller()))
    await server.start()
    pairs = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(MAX_CONNECTIONS + 1)]
    greetings = [await read(reader) for reader, _writer in pairs[:-1]]
    assert greetings == [GREETING] * MAX_CONNECTIONS
    assert await is_cut(pairs[-1][0])
    pairs[0][1].write(b"x" * 5000)
    assert await is_cut(pairs[0][0])
    for _reader, writer in pairs:
        writer.close()
    await server.stop()


async def test_commands_of_the_simulator_switch_it() -> None:
    simulator = SimulatedController()
    control = Control(simulator)
    assert "--dashboard" in await control.execute("remote off")
    simulator.dashboard = DashboardServer(PolyScope(simulator.controller))
    assert await control.execute("remote off") == "ok"
    assert not simulator.dashboard.polyscope.remote
    assert await control.execute("load none") == "ok"
    assert simulator.dashboard.polyscope.loaded is None
    assert (await control.execute("load x.urp")).startswith("error")
    assert await control.execute("drop-dashboard") == "ok 0"


async def test_a_port_that_is_taken_leaves_nothing_open() -> None:
    first = DashboardServer(PolyScope(Controller()))
    await first.start()
    simulator = SimulatedController()
    simulator.dashboard = DashboardServer(PolyScope(simulator.controller), port=first.port)
    with pytest.raises(OSError, match="in use"):
        async with simulator:
            pass
    assert simulator.has_port
    assert not simulator.started
    with pytest.raises(ConnectionRefusedError):
        await asyncio.open_connection("127.0.0.1", simulator.port)
    await first.stop()
