"""`gatewayd devices write`."""

from __future__ import annotations

import pytest

from tests.cli.conftest import Invoke
from tests.cli.devices.conftest import Plant


def test_through_the_gateway(plant: Plant, invoke: Invoke) -> None:
    plant.unit.registers = {100: 7}
    done = invoke("devices", "write", "island", "100", "-2", "--type", "int16")
    assert (done.exit_code, done.output) == (0, "holding 100: -2  fffeh  (was 7)\n")
    (record,) = plant.audit
    assert record.event.text().startswith("operator wrote island 100 = -2 (was 7, by ")


def test_mapped_place(plant: Plant, invoke: Invoke) -> None:
    done = invoke("devices", "write", "island", "coil:0..3", "on,on,on,on")
    assert done.exit_code == 1
    assert "`clamp` of cell press is mapped there; use `gatewayd force clamp VALUE`" in done.output
    assert plant.unit.bits == {}
    (record,) = plant.audit
    assert record.event.what == "write refused"


def test_without_a_gateway(lone_device: Plant, invoke: Invoke) -> None:
    def write(place: str) -> tuple[int, str]:
        done = invoke("devices", "write", "island", place, "on", "--mapping", str(lone_device.mapping))
        return done.exit_code, done.output

    code, output = write("coil:9")
    assert code == 0
    assert "no gateway runs, so no audit keeps this: " in output
    assert output.endswith("coil 9: on  (was off)\n")
    assert lone_device.unit.bits == {9: True}
    code, output = write("coil:0")
    assert (code, "gatewayd force clamp" in output) == (1, True)


def test_place_that_cannot_be_read(plant: Plant, invoke: Invoke) -> None:
    plant.unit.functions = {1, 2, 4, 6}
    done = invoke("devices", "write", "island", "100", "1")
    assert (done.exit_code, done.output) == (0, "holding 100: written; it cannot be read\n")


@pytest.mark.usefixtures("plant")
def test_value_that_the_place_cannot_hold(invoke: Invoke) -> None:
    done = invoke("devices", "write", "island", "100", "65536")
    assert done.exit_code == 1
    assert "not within 0..65535" in done.output
