"""Several robots in one process: names, ports, state of their own."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.simulator.control import RobotControls
from gatewayd.simulator.fleet import RobotHost, plain_robots, replayed_robots, scenario_robots
from gatewayd.simulator.scenario import parse_scenario
from gatewayd.simulator.settings import RobotSettings

TWO = parse_scenario(b"[robots.left]\nport = 40000\n[robots.right]\n", "cell.toml")


@pytest.mark.parametrize(
    "ports,found",
    [
        ((), {"left": 40000, "right": 30005}),
        ((0,), {"left": 0, "right": 0}),
        ((7000,), {"left": 7000, "right": 7001}),
        ((7000, 9), {"left": 7000, "right": 9}),
    ],
)
def test_ports_of_a_scenario(ports: tuple[int, ...], found: dict[str, int]) -> None:
    robots = scenario_robots(TWO, RobotHost(ports=ports))
    assert {name: robot.port for name, robot in robots.items()} == found


def test_ports_that_are_not_enough_are_refused() -> None:
    with pytest.raises(ValueError, match=r"cell\.toml has 2 robots, not 3 ports"):
        scenario_robots(TWO, RobotHost(ports=(1, 2, 3)))


@pytest.mark.parametrize(
    "ports,found",
    [
        ((), {"robot": 30004}),
        ((5,), {"robot": 5}),
        ((5, 0), {"robot1": 5, "robot2": 0}),
    ],
)
def test_a_robot_on_each_port(ports: tuple[int, ...], found: dict[str, int]) -> None:
    robots = plain_robots(RobotSettings(), RobotHost(ports=ports))
    assert {name: robot.port for name, robot in robots.items()} == found


async def test_each_robot_has_its_own_state_and_is_called_by_its_name() -> None:
    controls = RobotControls(robots := scenario_robots(TWO, RobotHost(ports=(0,))))
    assert await controls.execute("left: set output_int_register_0 4") == "ok"
    assert await controls.execute("right: get output_int_register_0") == "ok 0"
    assert robots["left"].get("output_int_register_0") == 4
    question = "error which robot? Begin with left: or right:"
    assert await controls.execute("get output_int_register_0") == question
    assert not controls.quit
    assert await controls.execute("quit") == "ok"
    assert controls.quit


async def test_a_single_robot_needs_no_name() -> None:
    controls = RobotControls(plain_robots(RobotSettings(), RobotHost(ports=(0,))))
    assert await controls.execute("get robot_mode") == "ok 7"
    assert await controls.execute("robot: get robot_mode") == "ok 7"


def test_a_recording_on_two_ports_is_read_twice(tmp_path: Path) -> None:
    path = tmp_path / "robot_data.csv"
    path.write_text("timestamp output_int_register_0\n1.0 1\n1.008 2\n")
    robots = replayed_robots(path, RobotSettings(), RobotHost(ports=(0, 0)), repeat=False)
    assert list(robots) == ["robot1", "robot2"]
    assert [robot.controller.rate for robot in robots.values()] == [125, 125]
