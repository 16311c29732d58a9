"""Lines in a trace."""

from __future__ import annotations

from gatewayd.links.robot.dashboard.traffic import DashboardTraffic


def test_lines_are_shown_as_they_are_and_steer_no_terminal() -> None:
    words = DashboardTraffic().words
    assert words(b"Robotmode: RUNNING\n", "127.0.0.1:29999", outgoing=False) == "Robotmode: RUNNING"
    assert "\x1b" not in words(b"\x1b[31m\xff\n", "", outgoing=False)
