"""What asking devices by hand has in common."""

from __future__ import annotations

import pytest

from gatewayd.links.access import AccessError
from gatewayd.links.devices.asking import refuse_mapped, running_devices
from gatewayd.links.examination import RunningCell
from tests.links.devices.cells import planned

CELL = planned().cell
PRESENT, LEVEL, SPEED, CLAMP, FORCE = range(5)


def test_what_is_mapped_is_named_with_what_to_do() -> None:
    refuse_mapped("coil 9", [], CELL)
    with pytest.raises(AccessError) as raised:
        refuse_mapped("holding 7", [SPEED, FORCE, FORCE], CELL)
    # What the robot gives can be forced where it goes; an output is the example.
    assert str(raised.value) == (
        "holding 7 is not written: `speed` and `force` of cell press is mapped there; use `gatewayd force force VALUE`"
    )


def test_devices_of_running_gateways() -> None:
    status = {
        "name": "press",
        "links": [{"name": "robot"}, {"name": "island"}, {"name": "encoder"}, {"name": "gone"}],
        "robot": {"family": None},
        "island": {"family": "modbus", "address": "127.0.0.1:502"},
        "encoder": {"family": "canopen", "address": "socketcan:can0"},
    }
    (found,) = running_devices([RunningCell("/run/gatewayd/control.sock", status)], "modbus")
    assert (found.name, found.status["address"]) == ("island", "127.0.0.1:502")
    assert found.words == "the gateway at /run/gatewayd/control.sock (cell press, device island)"
