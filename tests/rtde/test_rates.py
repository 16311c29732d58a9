"""Frequencies: what is asked for, and what comes of it (guide, section "Setup outputs")."""

from __future__ import annotations

import pytest

from gatewayd.rtde.messages import ControllerVersion
from gatewayd.rtde.rates import max_frequency, package_interval, requested_frequency

E, CB3 = ControllerVersion(5, 12, 0, 1), ControllerVersion(3, 15, 0, 1)


def test_a_controller_sends_at_most_once_a_cycle() -> None:
    assert [
        max_frequency(one) for one in (E, CB3, ControllerVersion(7, 0, 0, 0), ControllerVersion(4, 0, 0, 0))
    ] == [
        500,
        125,
        500,
        125,
    ]


@pytest.mark.parametrize(
    "wanted, asked, interval",
    [
        (0, 500, 0.002),
        (200, 200, 0.004),
        (1000, 500, 0.002),
        (0.5, 1, 1.0),
        (125, 125, 0.008),
        (499, 499, 0.002),
    ],
)
def test_its_rate_is_divided_by_a_whole_number(wanted: float, asked: float, interval: float) -> None:
    requested = requested_frequency(wanted, E)
    assert requested == asked
    assert package_interval(requested, E) == pytest.approx(interval)
