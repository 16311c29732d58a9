"""`gatewayd rtde get` against the simulator as a process."""

from __future__ import annotations

import json

from tests.cli.rtde.robot import place, rtde
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, free_port


def test_values_with_units_and_meanings(plant: Plant) -> None:
    simulator = plant.simulator()
    simulator.do("set input_int_register_24 -7")
    result = rtde("get", place(simulator), "input_int_register_24", "runtime_state,target_speed_fraction")
    assert result.exit_code == 0, result.output
    assert result.output.splitlines() == [
        "input_int_register_24  -7",
        "runtime_state          2  (running)",
        "target_speed_fraction  1",
    ]


def test_json_is_exact(plant: Plant) -> None:
    simulator = plant.simulator("--uptime", "5000")
    document = json.loads(rtde("get", place(simulator), "--json", "actual_q").output)
    assert (document["version"], document["robot"]) == (1, place(simulator))
    assert document["timestamp"] >= 5000
    assert len(document["values"]["actual_q"]) == 6


def test_a_field_that_is_not_there_is_named(plant: Plant) -> None:
    simulator = plant.simulator()
    result = rtde("get", place(simulator), "actual_qq", "actual_q")
    assert result.exit_code == 1
    assert "actual_qq: NOT_FOUND" in result.output
    assert "did you mean actual_q" in result.output


def test_who_cannot_be_reached_or_is_silent_is_said(plant: Plant) -> None:
    result = rtde("get", f"{HOST}:{free_port()}", "actual_q")
    assert result.exit_code == 1
    assert "its RTDE service is off" in result.output
    silent = plant.simulator("--silence")
    result = rtde("get", place(silent), "actual_q")
    assert result.exit_code == 1
    assert "the robot sends no data" in result.output


def test_wrong_usage() -> None:
    assert rtde("get", "127.0.0.1:1").exit_code == 2
    result = rtde("get", "127.0.0.1:1", "Actual_q")
    assert result.exit_code == 2
    assert "it is written actual_q" in result.output
