"""`gatewayd rtde info` against the simulator as a process."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from gatewayd.cli.rtde import info as module
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, free_port, wait_for


def info(*arguments: str) -> Result:
    return CliRunner().invoke(command, ("rtde", "info", *arguments), prog_name="gatewayd")


def test_a_controller_says_what_it_is(plant: Plant) -> None:
    simulator = plant.simulator("--version", "5.27.0", "--text-on-connect", "hello")
    result = info("--json", "--seconds", "0.2", f"{HOST}:{simulator.port}")
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert (found["software"].rpartition(".")[0], found["series"], found["protocol"]) == ("5.27.0", "e", 2)
    assert found["frequency"]["maximum"] == 500
    assert found["frequency"]["measured"] > 0
    assert found["uptime"] > 100
    assert found["states"]["robot_mode"] == {"value": 7, "meaning": "running"}
    assert [text["text"] for text in found["texts"]] == ["hello"]
    assert found["properties"]["answered"]
    assert found["properties"]["values"]["v1.software.version"] >> 48 == 5
    wait_for(lambda: simulator.do("clients") == "0", "the visit to be over")


def test_an_old_controller_is_silent_about_properties_and_has_no_such_state(plant: Plant) -> None:
    simulator = plant.simulator("--version", "3.9.0", "--protocol-v1")
    result = info("--seconds", "0.1", f"{HOST}:{simulator.port}")
    assert result.exit_code == 0, result.output
    assert "series cb3" in result.output
    assert "version 1" in result.output
    assert "properties     no answer" in result.output
    assert "safety_status" not in result.output


def test_no_data_is_said_and_no_failure(plant: Plant, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_FIRST_SAMPLE", 0.1)
    simulator = plant.simulator("--silence")
    result = info(f"{HOST}:{simulator.port}")
    assert result.exit_code == 0, result.output
    assert "no data came" in result.output


def test_who_cannot_be_reached_is_one_clear_line() -> None:
    result = info(f"{HOST}:{free_port()}")
    assert result.exit_code == 1
    assert result.output.startswith("gatewayd: ")
    assert "its RTDE service is off" in result.output
    assert len(result.output.splitlines()) == 1


@pytest.mark.parametrize("arguments", [(), ("robot:0",), ("--seconds", "0", "127.0.0.1")])
def test_wrong_usage(arguments: tuple[str, ...]) -> None:
    assert info(*arguments).exit_code == 2
