"""`gatewayd devices read`."""

from __future__ import annotations

import json

import pytest

from tests.cli.conftest import Invoke
from tests.cli.devices.conftest import Plant


def test_through_the_gateway(plant: Plant, invoke: Invoke) -> None:
    plant.unit.registers = {100: 7, 101: 65535}
    done = invoke("devices", "read", "island", "100..101")
    assert (done.exit_code, done.output) == (0, "holding 100: 7  0007h\nholding 101: 65535  ffffh\n")
    assert list(plant.audit) == []


def test_without_a_gateway(lone_device: Plant, invoke: Invoke) -> None:
    lone_device.unit.bits = {3: True}
    done = invoke("devices", "read", "island", "coil:2..3", "--mapping", str(lone_device.mapping))
    assert (done.exit_code, done.output) == (0, "coil 2: off\ncoil 3: on\n")


def test_json(plant: Plant, invoke: Invoke) -> None:
    plant.unit.registers = {100: 0x4148, 101: 0}
    for more in ([], ["--cell", "press"]):
        done = invoke("devices", "read", "island", "100", "--type", "float32", "--json", *more)
        assert json.loads(done.output)["values"] == [
            {"place": "holding 100..101", "value": 12.5, "raw": "41480000"}
        ]


@pytest.mark.usefixtures("plant")
def test_what_is_refused(invoke: Invoke) -> None:
    for arguments, says in (
        (("island", "foo"), "is no place in a Modbus device"),
        (("islnd", "1"), "there is no device islnd, only island, gripper"),
        (("gripper", "1"), "device gripper is not asked: "),
    ):
        done = invoke("devices", "read", *arguments)
        assert done.exit_code == 1
        assert says in done.output


def test_mapping_where_a_gateway_has_the_device(plant: Plant, invoke: Invoke) -> None:
    done = invoke("devices", "read", "island", "1", "--mapping", str(plant.mapping))
    assert done.exit_code == 1
    assert "talks to it already: ask through that gateway, without --mapping" in done.output


def test_mapping_that_says_nothing_of_the_device(lone_device: Plant, invoke: Invoke) -> None:
    done = invoke("devices", "read", "islnd", "1", "--mapping", str(lone_device.mapping))
    assert done.exit_code == 2
    assert "has no device islnd, only island, gripper" in done.output
    lone_device.mapping.write_text("gatewayd: 1\n")
    assert invoke("devices", "read", "island", "1", "--mapping", str(lone_device.mapping)).exit_code == 2


def test_device_that_does_not_answer(lone_device: Plant, invoke: Invoke) -> None:
    lone_device.unit.change = lambda _: None
    done = invoke("devices", "read", "island", "1", "--mapping", str(lone_device.mapping))
    assert done.exit_code == 1
    assert "no answer within 0.5 s" in done.output


def test_no_gateway(invoke: Invoke) -> None:
    assert invoke("devices", "read", "island", "1").exit_code == 2
