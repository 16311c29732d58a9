"""Scenarios at work: what happens in which cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from gatewayd.rtde.enums import ProgramState, RobotMode
from gatewayd.simulator.fleet import RobotHost, scenario_robots
from gatewayd.simulator.scenario import ScenarioError, parse_scenario
from gatewayd.simulator.server import SimulatedController
from gatewayd.simulator.timeline import Timeline

if TYPE_CHECKING:
    from tests.simulator.conftest import Client


def robot(table: str) -> SimulatedController:
    scenario = parse_scenario(f"[robots.robot]\n{table}".encode(), "cell.toml")
    return scenario_robots(scenario, RobotHost(ports=(0,), stepped=True))["robot"]


def problems(simulator: SimulatedController) -> list[str]:
    assert isinstance(simulator.follower, Timeline)
    return list(simulator.follower.problems)


async def test_each_command_comes_in_its_cycle() -> None:
    table = """timeline = '''
    0.010 set output_int_register_0 1
    0.020 set output_int_register_0 2
    0.020 safety protective-stop
    '''"""
    async with robot(table) as simulator:
        seen = []
        for _ in range(12):
            await simulator.step()
            seen.append(simulator.get("output_int_register_0"))
        assert seen == [0] * 4 + [1] * 5 + [2] * 3
        assert simulator.get("safety_mode") == 3
        await simulator.step(200)
        assert simulator.get("runtime_state") == ProgramState.PAUSED


async def test_what_is_at_the_start_is_there_before_anybody_connects() -> None:
    table = "start = '''\npower off\nset output_int_register_0 7\nhold input_int_register_0 by hmi\n'''"
    async with robot(table) as simulator:
        assert simulator.get("robot_mode") == RobotMode.POWER_OFF
        assert simulator.get("output_int_register_0") == 7
        assert simulator.controller.claims.owner("input_int_register_0") == "hmi"


async def test_a_restart_goes_through_the_start_again_and_not_through_the_timeline() -> None:
    table = """start = 'power off'
    timeline = '''
    0.002 set output_int_register_0 1
    0.004 restart
    0.006 set output_int_register_1 2
    '''"""
    async with robot(table) as simulator:
        await simulator.step(2)
        assert simulator.get("timestamp") == 0
        assert simulator.get("output_int_register_0") == 0
        assert simulator.get("robot_mode") == RobotMode.POWER_OFF
        await simulator.step()
        assert simulator.get("output_int_register_1") == 2


async def test_a_timeline_repeats() -> None:
    table = """repeat = 0.02
    timeline = '''
    0.002 set output_int_register_0 1
    0.010 set output_int_register_0 0
    '''"""
    async with robot(table) as simulator:
        seen = []
        for _ in range(30):
            await simulator.step()
            seen.append(simulator.get("output_int_register_0"))
    assert seen == ([1] * 4 + [0] * 6) * 3


async def test_time_goes_on_while_the_timestamp_is_frozen() -> None:
    table = "timeline = '''\n0.002 freeze on\n0.006 freeze off\n'''"
    async with robot(table) as simulator:
        await simulator.step(4)
        assert simulator.get("timestamp") == pytest.approx(100.004, abs=1e-6)


async def test_what_the_robot_refuses_is_reported_with_its_line() -> None:
    table = "timeline = '''\n0.002 power on\n0.004 set output_int_register_0 1\n'''"
    async with robot(table) as simulator:
        await simulator.step(2)
        assert simulator.get("output_int_register_0") == 1
        refused = "cell.toml:3: `power on`: the robot is RUNNING; it has to be POWER_OFF"
        assert problems(simulator) == [refused]


@pytest.mark.parametrize(
    "table,message",
    [
        ("timeline = '1 powr on'", "cell.toml:2: `powr on`: unknown command 'powr'"),
        (
            "start = '''\n\nset robot_mod 1'''",
            "cell.toml:4: `set robot_mod 1`: no field 'robot_mod'; did you",
        ),
        ("start = 'quit'", "cell.toml:2: `quit`: of no use in a scenario"),
        (
            "start = 'set payload_cog 1'",
            "cell.toml:2: `set payload_cog 1`: payload_cog takes 3 values, not 1",
        ),
        ("program = '''\nx = 1\n'''", "cell.toml:3: the controller has no field 'x'"),
        ("version = '5.2'\nhold = ['input_int_register_24']", "cell.toml:1: robot 'robot': no such input"),
    ],
)
def test_a_scenario_is_checked_before_it_is_played(table: str, message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        robot(table)
    assert str(caught.value).startswith(message)


async def test_a_timeline_may_wait_for_the_first_client(client: type[Client]) -> None:
    table = "begin = 'client'\ntimeline = '0.004 set output_int_register_0 1'"
    async with robot(table) as simulator, client(simulator.port) as one:
        await simulator.step(50)
        await one.stream("output_int_register_0")
        await simulator.step(5)
        assert [(await one.package())[0] for _ in range(5)] == [0, 0, 1, 1, 1]
