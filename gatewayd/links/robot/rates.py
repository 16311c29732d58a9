"""How often a controller sends packages, from what a mapping says of it."""

from __future__ import annotations

from typing import Final

from gatewayd.links.robot.sections import RobotSection
from gatewayd.rtde.fields import Series

MIN_RATE: Final = 0.1
"""Packages per second below which nobody can mean it; 0 stands for the controller's own rate."""
_MIN_FREQUENCY: Final = 0.001


def package_period(robot: RobotSection) -> float:
    """Seconds between output packages: the controller divides its base rate by a whole number.

    Where the series is not known the slowest that may answer counts: CB3 with 125 Hz for its own rate.
    """
    base = (Series.from_word(robot.series) if robot.series is not None else Series.CB3).base_rate
    if robot.frequency == 0:
        return 1 / base
    return 1 / robot.frequency if robot.series is None else max(int(base / robot.frequency), 1) / base


def package_rate(robot: RobotSection) -> float:
    """The largest number of packages per second that the controller may send; 500 where nothing is known."""
    base = max(series.base_rate for series in Series)
    if robot.series is not None:
        base = Series.from_word(robot.series).base_rate
    if robot.frequency == 0:
        return float(base)
    frequency = max(robot.frequency, _MIN_FREQUENCY)
    # The controller divides its base rate by a whole number, which makes it somewhat faster than asked for.
    return frequency if robot.series is None else base / max(int(base / frequency), 1)
