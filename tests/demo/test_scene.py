"""The five parties together, over real sockets and a bus of this process."""

from __future__ import annotations

import asyncio
import socket
from collections import deque

import pytest
from pymodbus.client import AsyncModbusTcpClient

from gatewayd.demo.master import RETRY
from gatewayd.demo.scene import HOST, Scene, free_port, mapping

SPEED_NOW = 12


async def test_values_go_both_ways(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    program = scene.plc.program
    await until(lambda: program.handshakes >= 1)
    assert program.wrong == []
    assert program.verified >= 3
    assert scene.plc.refused == 0


async def test_values_go_both_ways_on_canopen(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    master = scene.master
    await until(lambda: master.feeder.verified >= 2 and scene.plc.program.handshakes >= 2)
    assert master.feeder.wrong == []
    assert master.heartbeats > 0
    assert scene.problems == deque()


async def test_somebody_else_is_refused_with_busy(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    await until(lambda: scene.plc.program.order.start)
    client = AsyncModbusTcpClient(HOST, port=scene.port)
    assert await client.connect()
    try:
        refused = await client.write_register(1, 7)
        assert refused.exception_code == 6
        taken = await client.write_register(10, 50)
        assert not taken.isError()
        await until(lambda: scene.cell.image.values[SPEED_NOW] == 50.0)  # speed_now: the robot has answered
    finally:
        client.close()


async def test_who_connects_for_one_write_keeps_what_it_wrote(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    """As mbpoll does: half speed is promised to be yours for 5 s."""
    await until(lambda: scene.plc.program.order.start)
    client = AsyncModbusTcpClient(HOST, port=scene.port)
    assert await client.connect()
    assert not (await client.write_register(10, 50)).isError()
    client.close()
    await until(lambda: scene.cell.image.values[SPEED_NOW] == 50.0)
    assert {writer.name: writer.grace for writer in scene.cell.definition.writers}["you"] >= _lease("speed")


def test_the_line_renews_in_time_what_it_was_given_again() -> None:
    """The first RPDO that is taken begins the lease; the next one comes before the lease ends."""
    assert _lease("feed") > RETRY


def _lease(variable: str) -> float:
    plan = mapping().plan
    assert plan is not None
    [lock] = [lock for lock in plan.cell.locks if lock.name == variable]
    assert lock.lease is not None
    return lock.lease


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
