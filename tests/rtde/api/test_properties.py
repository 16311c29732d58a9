"""Properties as a program sees them: silence of an old controller is a normal answer."""

from __future__ import annotations

import pytest

from gatewayd import rtde
from gatewayd.rtde.api.properties import Properties
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.server import SimulatedController


async def test_an_old_controller_is_silent_and_stays_connected() -> None:
    async with (
        SimulatedController(Controller()) as served,
        rtde.connect("127.0.0.1", port=served.port, outputs=["robot_mode"]) as robot,
    ):
        for _ in range(10):
            found = await robot.properties(timeout=0.01)
            assert not found.answered
        assert len(found) == 0
        with pytest.raises(KeyError, match="no answer"):
            _ = found["v1.software.version"]
        await robot.newer(5)
        assert robot.statistics.sessions == 1


def test_a_name_without_a_value_says_why() -> None:
    found = Properties(True, {"a": 1}, {"b": "NOT_SET"})
    assert found["a"] == 1
    with pytest.raises(KeyError, match="b: NOT_SET"):
        _ = found["b"]
    with pytest.raises(KeyError, match="c: was not asked for"):
        _ = found["c"]
