"""What can be read of a robot without waiting, within a session and without."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from gatewayd import rtde

Connect = Callable[..., rtde.Robot]
OF_A_SESSION = (
    "version",
    "series",
    "protocol",
    "max_frequency",
    "frequency",
    "outputs",
    "outputs_id",
    "inputs",
    "unavailable",
)


@pytest.mark.parametrize("name", OF_A_SESSION)
async def test_what_is_of_a_session_is_not_told_without_one(name: str, connect: Connect) -> None:
    robot = connect(outputs=["robot_mode"])
    with pytest.raises(rtde.ConnectionLostError, match="not connected"):
        getattr(robot, name)
    async with robot:
        getattr(robot, name)
    with pytest.raises(rtde.ConnectionLostError):
        getattr(robot, name)


async def test_the_rest_is_always_there(connect: Connect) -> None:
    robot = connect(outputs=["robot_mode"])
    assert repr(robot) == f"<Robot 127.0.0.1:{robot.port} not opened>"
    assert (robot.host, robot.address) == ("127.0.0.1", f"127.0.0.1:{robot.port}")
    assert (robot.session, robot.latest, robot.last_text, robot.last_loss) == (None, None, None, None)
    assert (robot.own_address, robot.peer_address, robot.connected) == (None, None, False)
    assert (robot.measured_frequency, robot.overflowed, robot.statistics.packages) == (0, 0, 0)
    async with robot:
        assert robot.connected
        assert robot.session is not None


async def test_the_rate_is_measured(connect: Connect) -> None:
    async with connect(outputs=["robot_mode"], frequency=100) as robot:
        while not robot.measured_frequency:
            await robot.newer(5)
        assert robot.measured_frequency > 0
