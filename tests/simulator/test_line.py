"""A line that is late: nothing is lost, nothing overtakes."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

from gatewayd.rtde.messages import ControllerVersion, GetControllerVersion, Start, StartReply
from gatewayd.simulator.server import SimulatedController
from tests.simulator.conftest import Client

DELAY = 0.2


async def timed(work: Callable[[], Awaitable[object]]) -> float:
    loop = asyncio.get_running_loop()
    start = loop.time()
    await work()
    return loop.time() - start


async def test_answers_leave_late(simulator: SimulatedController) -> None:
    async with Client(simulator.port) as client:
        simulator.faults.delay = DELAY
        client.send(GetControllerVersion())
        assert await timed(lambda: client.receive(ControllerVersion)) > 0.9 * DELAY


async def test_packages_come_late_with_their_own_timestamps(simulator: SimulatedController) -> None:
    """A delay that is taken back shortens the line only once what waits has left: no package overtakes another."""
    async with Client(simulator.port) as client:
        await client.stream("timestamp", "output_int_register_0")
        simulator.faults.delay = DELAY
        await client.package()
        simulator.set("output_int_register_0", 7)
        now = float(simulator.controller.get("timestamp")[0])
        (sent_at, _) = await client.until(lambda values: values[1] == 7)
        assert float(simulator.controller.get("timestamp")[0]) - float(sent_at) > 0.8 * DELAY
        assert float(sent_at) - now < DELAY
        simulator.faults.delay = 0.0
        last = float(sent_at)
        for _ in range(200):
            stamp = float((await client.package())[0])
            assert stamp > last
            last = stamp


async def test_a_connection_that_ends_takes_what_waits_along(simulator: SimulatedController) -> None:
    async with Client(simulator.port) as client:
        client.send(GetControllerVersion())
        await client.receive(ControllerVersion)
        simulator.faults.delay = 60.0
        client.send(GetControllerVersion())
        simulator.drop_clients()
        await client.ended()
    simulator.faults.delay = 0.0
    async with Client(simulator.port) as client:
        client.send(Start())
        assert not (await client.receive(StartReply)).accepted
