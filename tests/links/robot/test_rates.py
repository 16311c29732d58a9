"""How often a controller sends."""

from __future__ import annotations

import pytest

from gatewayd.links.robot.rates import package_period, package_rate
from gatewayd.links.robot.sections import RobotSection


@pytest.mark.parametrize(
    "robot, packages",
    [
        ({}, 500),
        ({"series": "cb3"}, 125),
        ({"series": "e", "frequency": 125.0}, 125),
        ({"series": "e", "frequency": 200.0}, 250),
        ({"frequency": 60.0}, 60),
        ({"frequency": 1e-320}, 0.001),
    ],
)
def test_packages_per_second_at_most(robot: dict[str, object], packages: float) -> None:
    assert package_rate(RobotSection.model_validate({"host": "r", **robot})) == pytest.approx(packages)


@pytest.mark.parametrize(
    "robot, period",
    [
        ({}, 0.008),
        ({"series": "e"}, 0.002),
        ({"frequency": 50.0}, 0.02),
        ({"series": "e", "frequency": 200.0}, 0.004),
    ],
)
def test_time_between_packages(robot: dict[str, object], period: float) -> None:
    assert package_period(RobotSection.model_validate({"host": "r", **robot})) == pytest.approx(period)
