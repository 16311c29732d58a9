"""The three parties together, over real sockets."""

from __future__ import annotations

import asyncio
import socket

import pytest
from pymodbus.client import AsyncModbusTcpClient

from gatewayd.demo.scene import HOST, Scene, free_port


async def test_values_go_both_ways(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    program = scene.plc.program
    await until(lambda: program.handshakes >= 1)
    assert program.wrong == []
    assert program.verified >= 3
    assert scene.plc.refused == 0


async def test_somebody_else_is_refused_with_busy(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    await until(lambda: scene.plc.program.order.start)
    client = AsyncModbusTcpClient(HOST, port=scene.port)
    assert await client.connect()
    try:
        refused = await client.write_register(1, 7)
        assert refused.exception_code == 6
        taken = await client.write_register(10, 50)
        assert not taken.isError()
        await until(lambda: scene.cell.image.values[9] == 50.0)  # speed_now: the robot has answered
    finally:
        client.close()


def test_port_in_use_is_not_free() -> None:
    with socket.create_server((HOST, 0)) as taken, pytest.raises(OSError, match="in use"):
        free_port(HOST, taken.getsockname()[1])


@pytest.mark.parametrize("milliseconds", [0, 0.5, 1, 1.5, 2, 20])
async def test_ends_at_any_time(milliseconds: float) -> None:
    """Also while the PLC is about to connect."""
    scene = Scene(0)
    async with asyncio.timeout(10):
        async with scene.playing():
            await asyncio.sleep(milliseconds / 1000)
