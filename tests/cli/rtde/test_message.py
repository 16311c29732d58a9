"""`gatewayd rtde message` against the simulator as a process."""

from __future__ import annotations

import pytest

from tests.cli.rtde.robot import place, rtde
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, free_port


@pytest.mark.parametrize("level", ["info", "warning", "error"])
def test_a_line_reaches_the_controller(plant: Plant, level: str) -> None:
    simulator = plant.simulator()
    result = rtde("message", place(simulator), "gripper changed", "--level", level, "--source", "line 3")
    assert result.exit_code == 0, result.output
    assert result.output == f"sent at level {level}\n"
    assert "gripper changed" in simulator.wait_for_line("gripper changed", "line 3")


def test_an_exception_is_explained_and_confirmed(plant: Plant) -> None:
    simulator = plant.simulator()
    result = rtde("message", place(simulator), "cannot go on", "--level", "exception")
    assert result.exit_code == 2
    assert "add --confirm-exception if that is meant" in " ".join(result.output.split())
    result = rtde("message", place(simulator), "cannot go on", "--level", "exception", "--confirm-exception")
    assert result.exit_code == 0, result.output
    simulator.wait_for_line("cannot go on")


def test_what_cannot_be_sent_is_said() -> None:
    result = rtde("message", f"{HOST}:{free_port()}", "hello")
    assert result.exit_code == 1
    assert "its RTDE service is off" in result.output
    assert rtde("message", "127.0.0.1:1", " ").exit_code == 2


def test_a_text_that_is_too_long_is_refused(plant: Plant) -> None:
    result = rtde("message", place(plant.simulator()), "ä" * 200)
    assert result.exit_code == 2
    assert "RTDE takes 255" in result.output
