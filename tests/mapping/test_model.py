"""The typed models of the mapping language."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.core.definition import Fallback
from gatewayd.links.modbus_server.sections import Modbus, PlacementSpec
from gatewayd.links.robot.sections import RobotSection, Watchdog
from gatewayd.mapping.language import FILE, VARIABLE, WRITER
from gatewayd.mapping.model import Group
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import Invalid

SECTIONS = [
    FILE,
    RobotSection,
    Watchdog,
    Modbus,
    WRITER,
    Group,
    VARIABLE,
    PlacementSpec,
]


@pytest.mark.parametrize("section", SECTIONS)
def test_every_key_is_described(section: type[Section]) -> None:
    """Descriptions are what editors show and what hints quote."""
    assert [key for key, field in section.model_fields.items() if not field.description] == []


@pytest.mark.parametrize("section", SECTIONS)
def test_unknown_keys_are_refused(section: type[Section]) -> None:
    with pytest.raises(Invalid) as caught:
        section.model_validate({"no_such_key": 1})
    assert any(mistake.kind == "extra_forbidden" for mistake in caught.value.mistakes)


@pytest.mark.parametrize(
    "section, value",
    [
        (RobotSection, {"host": "r", "port": 0}),
        (RobotSection, {"host": "r", "frequency": 501}),
        (RobotSection, {"host": ""}),
        (RobotSection, {"host": "no host"}),
        (RobotSection, {"host": "r", "verify": "yes"}),
        (RobotSection, {"host": "r", "port": "30004"}),
        (Modbus, {"unit": 0}),
        (Modbus, {"unit": 248}),
        (Modbus, {"connections": 0}),
        (VARIABLE, {"robot": "x", "limits": [0]}),
        (VARIABLE, {"robot": "x", "limits": [0, 1, 2]}),
        (VARIABLE, {"robot": "x", "deadband": -1}),
        (VARIABLE, {"robot": "x", "unit": 5}),
        (VARIABLE, {"robot": "x", "owner": []}),
    ],
)
def test_values_out_of_their_range_are_refused(section: type[Section], value: Any) -> None:
    with pytest.raises(Invalid):
        section.model_validate(value)


def test_defaults_are_the_documented_ones() -> None:
    """The contract names these; changing one changes the meaning of every file that relies on it."""
    robot = RobotSection.model_validate({"host": "r"})
    assert (robot.port, robot.frequency, robot.on_connect, robot.verify) == (30004, 0, "adopt", True)
    modbus = Modbus()
    assert (str(modbus.listen), modbus.unit, modbus.allow, modbus.connections) == ("127.0.0.1:502", 1, (), 32)
    assert (modbus.idle_timeout, modbus.gaps, modbus.order) == (60.0, "refuse", "ABCD")
    variable = VARIABLE.model_validate({"robot": "x"})
    assert (variable.on_release, variable.on_stale, variable.clamp) == (Fallback(), Fallback(), False)


def test_models_are_immutable() -> None:
    modbus: Any = Modbus()
    with pytest.raises(AttributeError, match="Modbus is immutable"):
        modbus.unit = 2
    with pytest.raises(AttributeError, match="Modbus is immutable"):
        del modbus.unit
