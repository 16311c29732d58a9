"""A simulated controller in the process of the test, robots connected to it, and one that blocks for the commands."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.rtde.fields import SoftwareVersion
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.double import SimulatedRobot
from gatewayd.simulator.server import SimulatedController

Connect = Callable[..., rtde.Robot]
"""`rtde.connect` to the simulator of the test."""
PATIENCE = 10.0
"""Seconds for what should take a moment."""


async def until(condition: Callable[[], object]) -> None:
    """Returns as soon as it holds."""
    async with asyncio.timeout(PATIENCE):
        while not condition():  # noqa: ASYNC110  what is waited for is somebody else's state
            await asyncio.sleep(0)


async def event(robot: rtde.Robot, kind: type[Any]) -> Any:
    """The next event of that kind; those before it are passed over."""
    async with asyncio.timeout(PATIENCE):
        async for found in robot.events:
            if isinstance(found, kind):
                return found
    raise AssertionError(kind)


@pytest.fixture
async def simulator() -> AsyncIterator[SimulatedController]:
    """An e-Series controller that knows properties, without faults or program."""
    async with SimulatedController(Controller(version=SoftwareVersion(5, 26))) as served:
        yield served


@pytest.fixture
def connect(simulator: SimulatedController) -> Connect:
    """Robots at the simulator."""

    def make(**wishes: Any) -> rtde.Robot:
        return rtde.connect("127.0.0.1", port=simulator.port, **wishes)

    return make


@pytest.fixture(scope="module")
def robot() -> Iterator[SimulatedRobot]:
    """The same in a thread of its own, for commands and for the blocking API; for all tests of a module."""
    with SimulatedRobot(version="5.26") as running:
        yield running
