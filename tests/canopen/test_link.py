"""The link on a bus of this process: node, driver and the loop's clock together."""

from __future__ import annotations

import asyncio
import itertools
import logging
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import replace

import can
import pytest

from gatewayd.canopen.link import CORE_TIME, CanLink
from gatewayd.canopen.nmt import NmtState
from gatewayd.canopen.storage import MemoryStore
from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from tests.canopen.recorder import until
from tests.canopen.test_node import _CELL, NODE, PART, PLAN

CHANNELS = (f"link {number}" for number in itertools.count())
PATIENCE = 10.0


class Master:
    """The other end of the bus."""

    def __init__(self, channel: str) -> None:
        self._bus = can.Bus(interface="virtual", channel=channel)
        self.seen: list[tuple[int, bytes]] = []

    def send(self, can_id: int, data: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def has(self, can_id: int, data: bytes) -> bool:
        while (message := self._bus.recv(0)) is not None:
            self.seen.append((message.arbitration_id, bytes(message.data)))
        return (can_id, data) in self.seen

    def close(self) -> None:
        self._bus.shutdown()


class Line:
    """A cell with a robot, its link, and a master."""

    def __init__(self) -> None:
        channel = next(CHANNELS)
        self.cell = Cell(_CELL)
        self.master = Master(channel)
        self.link = CanLink(replace(PLAN, channel=channel, heartbeat=100), self.cell, MemoryStore())
        self.ticking = True

    async def _tick(self) -> None:
        while True:
            if self.ticking:
                self.cell.tick(time.monotonic())
            await asyncio.sleep(0.02)

    @asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        now = time.monotonic()
        self.cell.robot_connected(now)
        self.cell.adopt({PART: 0}, now)
        tasks = [asyncio.create_task(self._tick()), asyncio.create_task(self.link.run())]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
                with suppress(asyncio.CancelledError):
                    await task
            self.master.close()


@pytest.fixture
async def line() -> AsyncIterator[Line]:
    made = Line()
    async with made.running():
        await until(lambda: made.master.has(0x700 + NODE, b"\0"), PATIENCE)
        yield made


async def test_values_go_both_ways(line: Line) -> None:
    line.master.send(0, bytes([1, NODE]))
    await until(lambda: line.link.node.nmt.state is NmtState.OPERATIONAL, PATIENCE)
    line.master.send(0x200 + NODE, (-7).to_bytes(4, "little", signed=True))
    await until(lambda: line.cell.image.values[PART] == -7, PATIENCE)
    line.master.send(0x600 + NODE, bytes.fromhex("4000100000000000"))
    await until(lambda: line.master.has(0x580 + NODE, bytes.fromhex("4300100000000000")), PATIENCE)


async def test_status_of_the_cell_tells_bus_and_node(line: Line) -> None:
    assert line.cell.health.can_bus == 6
    line.master.send(0, bytes([2, NODE]))
    await until(lambda: line.cell.health.nmt_state == NmtState.STOPPED, PATIENCE)


async def test_heartbeat_stops_with_the_core_and_comes_back(line: Line) -> None:
    await until(lambda: line.master.has(0x700 + NODE, b"\x7f"), PATIENCE)
    line.ticking = False
    await asyncio.sleep(CORE_TIME + 0.3)
    line.master.has(0, b"")
    line.master.seen.clear()
    await asyncio.sleep(0.4)
    assert not line.master.has(0x700 + NODE, b"\x7f")
    line.ticking = True
    await until(lambda: line.master.has(0x700 + NODE, b"\x7f"), PATIENCE)


async def test_end_of_the_link_takes_its_writers_and_its_bus_away(caplog: pytest.LogCaptureFixture) -> None:
    line = Line()
    caplog.set_level(logging.INFO, "gatewayd.canopen")
    async with line.running():
        await until(lambda: line.master.has(0x700 + NODE, b"\0"), PATIENCE)
        line.master.send(0x600 + NODE, bytes.fromhex("4000100000000000"))
        await until(lambda: line.master.has(0x580 + NODE, bytes.fromhex("4300100000000000")), PATIENCE)
    assert line.cell.health.can_bus == 2
    assert [event.detail for event in line.cell.events if event.kind is EventKind.WRITER_LOST] == ["bus down"]
    assert "CAN bus down" in caplog.text


async def test_interface_that_does_not_exist_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    link = CanLink(replace(PLAN, interface="no-such-thing"), Cell(_CELL), MemoryStore())
    task = asyncio.create_task(link.run())
    await until(lambda: "no-such-thing" in caplog.text, PATIENCE)
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
    assert caplog.text.count("cannot use the interface no-such-thing") == 1
    assert "Traceback" not in caplog.text
