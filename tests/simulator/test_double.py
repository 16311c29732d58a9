"""Simulated robots for tests that block: in a thread and in a process, by the same calls."""

from __future__ import annotations

import socket
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from gatewayd import rtde
from gatewayd.rtde import sync
from gatewayd.rtde.recording import RecordingError
from gatewayd.simulator.double import RobotCommandError, SimulatedRobot
from gatewayd.simulator.double_process import RobotProcessError
from gatewayd.simulator.scenario import ScenarioError

if TYPE_CHECKING:
    from tests.simulator.conftest import Client

where = pytest.mark.parametrize("process", [False, True], ids=["thread", "process"])
TWO = '[robots.left]\nstart = "set output_int_register_0 5"\n[robots.right]\nmodel = "ur20"\n'


@where
def test_a_blocking_client_works_with_it(process: bool) -> None:
    """The whole way of a test: what the client writes is waited for, what the robot shows is set."""
    robot = SimulatedRobot(program="output_int_register_1 = input_int_register_24 * 2", process=process)
    with (
        robot,
        sync.connect(
            robot.host,
            port=robot.port,
            outputs=["output_int_register_0", "output_int_register_1"],
            inputs={"in": ["input_int_register_24"]},
        ) as client,
    ):
        assert robot.clients == 1
        client.write("in", input_int_register_24=21)
        assert robot.wait_for("input_int_register_24", 21) == 21
        assert robot.wait_for("output_int_register_1", lambda value: value > 0) == 42
        robot.set("output_int_register_0", 7)
        while client.newer(10).output_int_register_0 != 7:
            pass


@where
def test_fields_come_as_they_are(process: bool) -> None:
    with SimulatedRobot(process=process) as robot:
        robot.set("output_bit_register_64", True)
        robot.set("actual_q", 0, -1.5, 1, 0, 0.25, 0)
        robot.set("runtime_state", "PAUSED")
        assert robot.get("output_bit_register_64") is True
        assert robot.get("actual_q") == (0.0, -1.5, 1.0, 0.0, 0.25, 0.0)
        assert robot.get("runtime_state") == 4
        with pytest.raises(RobotCommandError, match="get actual_p: no field 'actual_p'"):
            robot.get("actual_p")


@where
def test_several_robots_are_called_by_their_names(process: bool) -> None:
    with SimulatedRobot(TWO, process=process) as left:
        right = left.robots["right"]
        assert (left.name, right.name) == ("left", "right")
        assert left.port != right.port
        assert [robot.get("output_int_register_0") for robot in left.robots.values()] == [5, 0]


@where
def test_time_that_is_stepped_makes_a_test_repeatable(process: bool) -> None:
    timeline = "0.01 set output_int_register_0 3\n0.02 safety protective-stop"
    with SimulatedRobot(stepped=True, timeline=timeline, process=process) as robot:
        assert robot.step(4) == 4
        assert robot.get("output_int_register_0") == 0
        assert robot.step() == 5
        assert (robot.get("output_int_register_0"), robot.get("safety_mode")) == (3, 1)
        robot.step(200)
        assert (robot.get("safety_mode"), robot.get("runtime_state")) == (3, 4)


async def test_steps_go_on_beside_a_client_on_this_loop(client: type[Client]) -> None:
    with SimulatedRobot(stepped=True) as robot:
        async with client(robot.port) as one:
            await one.stream("timestamp")
            assert await robot.step_async(3) == 3
            assert [(await one.package())[0] for _ in range(3)] == pytest.approx([100.002, 100.004, 100.006])


def test_only_what_is_stepped_has_steps() -> None:
    with SimulatedRobot() as robot, pytest.raises(RobotCommandError, match=r"step 1: time follows the clock"):
        robot.step()


def test_inputs_of_another_client_are_in_use() -> None:
    with SimulatedRobot() as robot:
        robot.hold("input_int_register_24", by="hmi")
        held = {"in": ["input_int_register_24"]}
        with pytest.raises(rtde.FieldsRefusedError):
            sync.connect(robot.host, port=robot.port, outputs=["timestamp"], inputs=held).open()
        robot.free("input_int_register_24")
        with sync.connect(robot.host, port=robot.port, outputs=["timestamp"], inputs=held):
            pass


def test_faults_and_modes() -> None:
    with SimulatedRobot(speed=20) as robot:
        robot.faults.freeze()
        stood = robot.get("timestamp")
        assert robot.get("timestamp") == stood
        robot.faults.freeze(on=False)
        robot.wait_for("timestamp", lambda time: time > stood)
        for switch in (robot.faults.creep, robot.faults.silence):
            switch()
            switch(on=False)
        robot.faults.delay(0.01)
        robot.faults.pause(0)
        robot.faults.drop_at("data:10")
        robot.faults.drop_at(None)
        robot.faults.text("hello")
        robot.faults.raw(b"\0\3R")
        assert robot.faults.drop_clients() == 0
        robot.power("off")
        robot.wait_for("robot_mode", 3)
        robot.power("on")
        robot.wait_for("robot_mode", 5)
        robot.power("release")
        robot.wait_for("robot_mode", 7)
        robot.program("play")
        robot.overwrite("output_int_register_0", 4)
        robot.safety("robot-emergency-stop")
        robot.wait_for("runtime_state", 1)
        robot.overwrite("output_int_register_0")
        robot.restart()
        assert robot.get("robot_mode") == 7
        with pytest.raises(TimeoutError, match=r"robot_mode is 7 after 0\.01 s"):
            robot.wait_for("robot_mode", 5, timeout=0.01)


@where
def test_a_recording_is_replayed(tmp_path: Path, process: bool) -> None:
    path = tmp_path / "robot_data.csv"
    path.write_text("timestamp output_int_register_0\n1.0 1\n1.008 2\n1.016 3\n")
    robot = SimulatedRobot(replay=path, loop=True, process=process)
    with robot, sync.connect(robot.host, port=robot.port, outputs=["output_int_register_0"]) as client:
        seen = []
        for sample in client:
            seen.append(sample.output_int_register_0)
            if len(seen) == 7:
                break
        assert seen == [1, 2, 3, 1, 2, 3, 1]


@where
@pytest.mark.parametrize(
    "arguments,error,message",
    [
        (
            {"serie": "e"},
            ScenarioError,
            r"SimulatedRobot\(...\):2: unknown key 'serie'; did you mean 'series'",
        ),
        ({"start": "power up"}, ScenarioError, r"SimulatedRobot\(...\):2: `power up`: 'up' is not one of"),
        ({"scenario": "none.toml"}, FileNotFoundError, "none.toml"),
        ({"replay": "none.csv"}, RecordingError, "none.csv: cannot be read"),
        ({"replay": "none.csv", "series": "e"}, TypeError, "one of them describes the robot"),
        ({"host": "192.0.2.1"}, (OSError, RobotProcessError), "Cannot assign|cannot assign|could not bind"),
    ],
)
def test_what_cannot_be_is_an_error(
    process: bool, arguments: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        SimulatedRobot(process=process, **arguments)


def test_a_table_of_faults_and_keys_of_every_kind() -> None:
    faults = {
        "delay": 0.0,
        "unreadable": ["input_int_register_0"],
        "freeze": True,
        "text_on_connect": 'a "b"',
    }
    with SimulatedRobot(series="x", hold=("input_int_register_3",), faults=faults) as robot:
        assert robot.get("timestamp") == robot.get("timestamp")
        with pytest.raises(RobotCommandError, match="in use by the controller itself"):
            robot.hold("input_int_register_3", by="hmi")


def test_it_can_be_closed_twice() -> None:
    for process in (False, True):
        robot = SimulatedRobot(process=process)
        robot.close()
        robot.close()


def test_a_client_that_was_accepted_just_before_the_end_is_closed() -> None:
    for _ in range(20):
        robot = SimulatedRobot()
        with socket.create_connection((robot.host, robot.port)) as client:
            robot.close()
            client.settimeout(5)
            with suppress(ConnectionResetError):
                assert client.recv(1) == b""
