"""The pages with CAN frames, played by hand as their reader does: every frame that they show comes."""

from __future__ import annotations

import asyncio
import re
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path

import can
import pytest

from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.links.robot.plan import robot_of
from gatewayd.mapping.loader import load
from gatewayd.service.daemon import Daemon
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.program import DEMO, parse
from gatewayd.simulator.server import SimulatedController
from tests.docs.generated import DOCS

HOST = "127.0.0.1"
PATIENCE = 15.0
TUTORIAL = (DOCS / "tutorial" / "4-canopen.md").read_text()
GUIDE = (DOCS / "howto" / "commission-node.md").read_text()
every_page = pytest.mark.parametrize("page", [TUTORIAL, GUIDE], ids=["4-canopen", "commission-node"])
MAPPING = re.search(r"<!-- file: line-cell.yaml -->\n```yaml\n(.*?)^```", TUTORIAL, re.MULTILINE | re.DOTALL)
SEND = re.compile(r"^(while .*)?cansend vcan0 ([0-9A-F]{3})#([0-9A-F]*)", re.MULTILINE)
SHOWN = re.compile(
    r"^vcan0  ([0-9A-F]{3})   \[(\d)\]  ((?:[0-9A-F]{2}|\.\.)(?: (?:[0-9A-F]{2}|\.\.))*)$", re.MULTILINE
)
STEP = re.compile(r"^(<!-- play: no heartbeat -->\n)?```(?:sh|text)\n(.*?)^```", re.MULTILINE | re.DOTALL)


class Hand:
    """The reader's terminals: `cansend`, `candump`, and the loop that sends a heartbeat."""

    def __init__(self, channel: str) -> None:
        self._bus = can.Bus(interface="virtual", channel=channel)
        self.seen: list[str] = []
        self._loop: asyncio.Task[None] | None = None

    def send(self, can_id: str, data: str) -> None:
        self._bus.send(
            can.Message(arbitration_id=int(can_id, 16), data=bytes.fromhex(data), is_extended_id=False)
        )

    def repeat(self, can_id: str, data: str) -> None:
        async def forever() -> None:
            while True:
                self.send(can_id, data)
                await asyncio.sleep(0.4)

        self._loop = asyncio.create_task(forever())

    async def end_loop(self) -> None:
        if self._loop is not None:
            self._loop.cancel()
            with suppress(asyncio.CancelledError):
                await self._loop
            self._loop = None

    async def wait_for(self, frame: str) -> None:
        pattern = re.compile(frame)
        end = time.monotonic() + PATIENCE
        while not any(map(pattern.fullmatch, self.seen)):
            assert time.monotonic() < end, f"{frame} never came; there were {self.seen[-10:]}"
            while (message := self._bus.recv(0)) is not None:
                self.seen.append(f"{message.arbitration_id:03X} {bytes(message.data).hex(' ').upper()}")
            await asyncio.sleep(0.01)

    def close(self) -> None:
        self._bus.shutdown()


@asynccontextmanager
async def running(state: Path) -> AsyncIterator[Hand]:
    """Simulator, gateway and the reader."""
    assert MAPPING
    plan = load(MAPPING[1].encode(), "line-cell.yaml").plan
    assert plan is not None
    assert canopen_of(plan) is not None
    # Robot, gateway and reader share this process: where it waits for a processor, the robot is not to look stale.
    plan = replace(plan, cell=replace(plan.cell, stale_after=10.0))
    hand = Hand("tutorial")
    stop = asyncio.Event()
    async with SimulatedController(Controller(program=parse(DEMO)), host=HOST) as robot:
        canopen = replace(plan.the(CanopenPlan), interface="virtual", channel="tutorial")
        here = plan.with_links(robot=replace(robot_of(plan), host=HOST, port=robot.port), canopen=canopen)
        gateway = asyncio.create_task(Daemon([here], state).run(stop))
        try:
            yield hand
        finally:
            await hand.end_loop()
            stop.set()
            await gateway
            hand.close()


def steps(page: str) -> Iterator[tuple[bool, str]]:
    """The blocks of the page."""
    for found in STEP.finditer(page):
        yield bool(found[1]), found[2]


@every_page
async def test_every_frame_that_is_shown_comes(page: str, tmp_path: Path) -> None:
    shown = 0
    async with running(tmp_path) as hand:
        await hand.wait_for(r"710 00")
        for loses_heartbeat, block in steps(page):
            sends = list(SEND.finditer(block))
            if loses_heartbeat:
                await hand.end_loop()
            if sends or loses_heartbeat:
                hand.seen.clear()
            for send in sends:
                (hand.repeat if send[1] else hand.send)(send[2], send[3])
            for can_id, length, data in SHOWN.findall(block):
                assert len(data.split()) == int(length)
                await hand.wait_for(f"{can_id} {data}")
                shown += 1
    assert shown == len(SHOWN.findall(page))


@every_page
def test_every_frame_of_the_page_is_read(page: str) -> None:
    """No line that looks like a frame is overlooked by the pattern."""
    assert len(SHOWN.findall(page)) == len(re.findall(r"^vcan0 ", page, re.MULTILINE))
