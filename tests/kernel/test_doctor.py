"""What `gatewayd doctor` sees of CAN interfaces of a real kernel."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from dataclasses import replace

from gatewayd.canopen.frame import Frame
from gatewayd.links.canopen_node.doctor import EXAMINATION
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.examination import Observation, Surroundings
from gatewayd.mapping.loader import load
from tests.kernel.bench import Peer, SerialAdapter, ip

MAPPING = b"""\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1}
canopen: {channel: can0, bitrate: 500000, node: 16}
variables: {mode: {robot: robot_mode, canopen: auto}}
"""


async def look(channel: str, bitrate: int = 500_000) -> dict[str, str]:
    plan = load(MAPPING, "a.yaml").plan
    assert plan is not None
    node = replace(plan.the(CanopenPlan), channel=channel, bitrate=bitrate)
    seen: AsyncIterator[Observation] = EXAMINATION.examine(node, plan.cell, Surroundings())
    return {one.check: f"{one.outcome.value}: {one.text}" async for one in seen}


@contextlib.asynccontextmanager
async def another_node(channel: str, identifier: int) -> AsyncIterator[None]:
    """A node that sends a heartbeat again and again."""
    peer = Peer(channel)

    async def beat() -> None:
        while True:
            peer.send(Frame(identifier, b"\x05"))
            await asyncio.sleep(0.05)

    beating = asyncio.create_task(beat())
    try:
        yield
    finally:
        beating.cancel()
        peer.close()


async def test_a_virtual_bus_and_who_is_on_it(vcan: str) -> None:
    assert await look(vcan) == {
        "interface": f"ok: {vcan} is there",
        "bus state": f"ok: {vcan} is up",
        "bit rate": f"note: {vcan} reports none: a virtual bus, or an adapter at a serial line, where slcand sets it",
        "traffic": "note: nothing in 1.5 s: no other node sends, or none is on",
    }
    async with another_node(vcan, 0x705):
        found = await look(vcan)
    assert found["traffic"].startswith("ok: ")
    assert "node-ID" not in found
    async with another_node(vcan, 0x710):
        found = await look(vcan)
    assert found["node-ID"] == "problem: a node with node-ID 16 is on the bus already"
    ip("link", "set", vcan, "down")
    assert (await look(vcan))["bus state"] == f"problem: {vcan} is down"


async def test_what_is_no_can_interface() -> None:
    assert await look("lo") == {"interface": "problem: lo is not a CAN interface"}
    assert await look("nocan") == {"interface": "problem: there is no interface nocan"}


async def test_a_controller_with_another_bit_rate(adapter: SerialAdapter) -> None:
    found = await look(adapter.name, 250_000)
    assert found["bit rate"] == f"problem: {adapter.name} runs at 500000 bit/s, the mapping says 250000"
    assert (await look(adapter.name))["bit rate"] == "ok: 500000 bit/s, as the mapping says"
