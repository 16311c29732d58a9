"""The manager on a bus of the loop, with a node of durand in the same process."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from typing import Any
from uuid import uuid4

import can
import pytest
from durand import MinimalNode
from durand.network import NetworkABC

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.manager.plan import ManagerPlan, NodePlan
from gatewayd.canopen.manager.runtime import Manager
from gatewayd.loop import clock
from tests.canopen.manager.bench import Diary
from tests.links.canopen_node.recorder import until


class LoopNetwork(NetworkABC):  # type: ignore[misc]  # durand has no types
    """What a node of durand needs of a bus, in the loop: durand's own has a thread that outlives it for a second."""

    def __init__(self, channel: str) -> None:
        self._bus = can.Bus(channel, interface="virtual")
        self._callbacks: dict[int, Callable[[int, bytes], None]] = {}
        self._task = asyncio.create_task(self._read())

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        self._callbacks[cob_id] = callback

    def remove_subscription(self, cob_id: int) -> None:
        del self._callbacks[cob_id]

    def send(self, cob_id: int, msg: bytes) -> None:
        self._bus.send(can.Message(arbitration_id=cob_id, data=msg, is_extended_id=False))

    def close(self) -> None:
        self._task.cancel()
        self._bus.shutdown()

    async def _read(self) -> None:
        while True:
            while (message := self._bus.recv(0)) is not None:
                if (callback := self._callbacks.get(message.arbitration_id)) is not None:
                    callback(message.arbitration_id, bytes(message.data))
            await asyncio.sleep(0.001)


@pytest.fixture
async def channel() -> AsyncIterator[str]:
    """A virtual bus with node 5 on it."""
    name = str(uuid4())
    network = LoopNetwork(name)
    MinimalNode(network, 5)
    yield name
    network.close()


def _manager(channel: str, **options: Any) -> tuple[Manager, list[str]]:
    lines: list[str] = []
    return Manager(
        ManagerPlan("virtual", channel, 500_000, node=127, heartbeat=10), report=lines.append, **options
    ), lines


async def test_devices_come_and_go_while_it_runs(channel: str) -> None:
    manager, lines = _manager(channel)
    diary = Diary()
    passed: list[tuple[int, bool]] = []
    manager.tap = lambda frame, outgoing: passed.append((frame.can_id, outgoing))
    first = manager.attach(NodePlan(5), diary)
    task = asyncio.create_task(manager.run())
    await until(lambda: first.running)
    assert manager.bus is BusState.ACTIVE
    manager.detach(5, "a reload")
    second = manager.attach(NodePlan(5), diary)
    await until(lambda: second.running)
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
    assert diary.events == ["started", "ended: a reload", "started", "ended: the CAN bus is away"]
    assert lines == [f"CAN bus active: virtual {channel} is open", "CAN bus down: the manager ends"]
    assert {(0x605, True), (0x585, False), (0, True)} <= set(passed)
    # It may run again.
    again = asyncio.create_task(manager.run())
    await until(lambda: second.running)
    again.cancel()
    with suppress(asyncio.CancelledError):
        await again


async def test_its_heartbeat_is_sent_by_the_loop_and_needs_the_core(channel: str) -> None:
    lives = True
    manager, _ = _manager(channel, alive=lambda _now: lives)
    peer = can.Bus(channel, interface="virtual")
    task = asyncio.create_task(manager.run())

    def beats() -> int:
        count = 0
        while (message := peer.recv(0)) is not None:
            count += message.arbitration_id == 0x77F and message.data == b"\5"
        return count

    await until(lambda: beats() > 0)
    lives = False
    beats()
    # A bus that carries something else shows that time has passed.
    await asyncio.sleep(0.05)
    assert beats() == 0
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
    peer.shutdown()


async def test_gap_moves_deadlines_away_and_the_timer_follows(channel: str) -> None:
    manager, _ = _manager(channel)
    diary = Diary()
    node = manager.attach(NodePlan(5, heartbeat=0.2, producer=20), diary)
    task = asyncio.create_task(manager.run())
    await until(lambda: node.running)
    now = clock.now()
    manager.gap(now - 1.0, now)
    await asyncio.sleep(0.3)
    assert diary.events == ["started"]
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


async def test_bus_that_cannot_be_used_is_reported_once_and_tried_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("gatewayd.canopen.manager.runtime.REOPEN", 0.01)
    lines: list[str] = []
    manager = Manager(ManagerPlan("no such interface", "x", 500_000), report=lines.append)
    task = asyncio.create_task(manager.run())
    await until(lambda: manager.reason)
    await asyncio.sleep(0.05)
    assert len(lines) == 1
    assert "no such interface" in manager.reason
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task
