"""`gatewayd devices`: the list of devices, and the two spellings of what else it does."""

from __future__ import annotations

import json

import pytest

from tests.cli.conftest import Invoke
from tests.cli.devices.conftest import Plant, plant

__all__ = ["plant"]


def test_list_of_devices(plant: Plant, invoke: Invoke) -> None:
    done = invoke("devices")
    lines = done.output.splitlines()
    assert done.exit_code == 1
    assert lines[0].startswith("island  good")
    assert lines[0].endswith(f"127.0.0.1:{plant.port} unit 1")
    assert " in " in lines[1]
    (gripper,) = (number for number, line in enumerate(lines) if line.startswith("gripper"))
    assert "lost" in lines[gripper]
    assert "/dev/ttyUSB0 115200 8N1 unit 9" in lines[gripper]


@pytest.mark.usefixtures("plant")
def test_json(invoke: Invoke) -> None:
    found = json.loads(invoke("devices", "--json").output)
    assert [(device["cell"], device["name"], device["family"]) for device in found] == [
        ("press", "island", "modbus"),
        ("press", "gripper", "modbus"),
    ]
    assert json.loads(invoke("devices", "--json", "--cell", "other").output) == []


@pytest.mark.usefixtures("gateway")
def test_gateway_without_devices(invoke: Invoke) -> None:
    done = invoke("devices")
    assert (done.exit_code, done.output) == (0, "no devices: no mapping of this gateway has `devices`\n")


def test_no_gateway(invoke: Invoke) -> None:
    assert invoke("devices").exit_code == 2


@pytest.mark.usefixtures("plant")
def test_options_are_taken_for_commands(invoke: Invoke) -> None:
    assert (
        invoke("devices", "--read", "island", "100").output
        == invoke("devices", "read", "island", "100").output
    )
    assert invoke("devices", "--scan=127.0.0.1:1", "--numbers", "x").exit_code == 2
    assert "VALUE" in invoke("devices", "--write", "--help").output


def test_unknown_command(invoke: Invoke) -> None:
    assert "Did you mean 'scan'?" in invoke("devices", "scann").output
