"""What a simulated robot is made of."""

from __future__ import annotations

import pytest

from gatewayd.rtde.fields import Series, SoftwareVersion
from gatewayd.simulator.settings import (
    RobotSettings,
    read_field,
    read_generation,
    read_inputs,
    read_seconds,
)


def test_each_controller_has_faults_of_its_own() -> None:
    settings = RobotSettings(faults={"delay": 1.0})
    one, other = settings.controller(), settings.controller()
    one.faults.freeze = True
    assert (other.faults.freeze, other.faults.delay) == (False, 1.0)


@pytest.mark.parametrize(
    "series,version,found",
    [
        (None, None, (Series.E, None)),
        ("cb3", None, (Series.CB3, None)),
        (None, "10.7", (Series.X, SoftwareVersion(10, 7, 0))),
    ],
)
def test_series_and_version_decide_each_other(
    series: str | None, version: str | None, found: tuple[Series, SoftwareVersion | None]
) -> None:
    assert read_generation(series, version) == found


def test_what_cannot_be_read_is_named() -> None:
    with pytest.raises(ValueError, match="'x:REAL' is not NAME:TYPE"):
        read_field("x:REAL")
    with pytest.raises(ValueError, match="no such input: a, b"):
        read_inputs(["b", "a", "input_int_register_0"])
    with pytest.raises(ValueError, match="'inf' is not a number of seconds"):
        read_seconds("inf")
    assert read_field("dexterity:DOUBLE").name == "dexterity"
