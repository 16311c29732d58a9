"""How often a controller sends packages: its own rate, and what becomes of a frequency that is asked for."""

from __future__ import annotations

from gatewayd.rtde.fields import Series
from gatewayd.rtde.messages import ControllerVersion

V1_RATE = 125
"""Packages per second in protocol version 1, which cannot choose."""
_RATE_UNKNOWN = {True: 500, False: 125}
_NEW_HARDWARE = 5


def max_frequency(controller: ControllerVersion) -> int:
    """Control cycles per second of a controller with this software, in Hz: packages come at most this often."""
    series = Series.from_major(controller.major)
    return series.base_rate if series else _RATE_UNKNOWN[controller.major >= _NEW_HARDWARE]


def requested_frequency(wanted: float, controller: ControllerVersion) -> float:
    """What to ask a controller for, in Hz: `wanted` within its limits; 0 is its own rate."""
    rate = max_frequency(controller)
    return min(max(wanted, 1.0), rate) if wanted else float(rate)


def package_interval(requested: float, controller: ControllerVersion) -> float:
    """Seconds between packages: the controller divides its own rate by a whole number."""
    rate = max_frequency(controller)
    return (rate // requested) / rate
