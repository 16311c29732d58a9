"""A simulated controller on a free port, and robots connected to it."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest

from gatewayd import rtde
from gatewayd.rtde.fields import SoftwareVersion
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.server import SimulatedController

Connect = Callable[..., rtde.Robot]
"""`rtde.connect` to the simulator of the test."""


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
