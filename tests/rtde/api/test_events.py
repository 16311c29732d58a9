"""Every event is a line for people."""

from __future__ import annotations

import pytest

from gatewayd.rtde.api import events
from gatewayd.rtde.loss import Loss, LossReason
from gatewayd.rtde.session import Unavailable

LOSS = Loss(LossReason.CLOSED, "robot: connection closed", retry_in=0.5)


@pytest.mark.parametrize(
    "event, line",
    [
        (
            events.ConnectedEvent(None, ("192.0.2.1", 30004)),
            "connected to 192.0.2.1:30004 from an unknown address",
        ),
        (events.LostEvent(LOSS, final=False), "lost: robot: connection closed; next attempt in 0.5 s"),
        (events.AttemptFailedEvent(LOSS, final=True), "robot: connection closed; given up"),
        (events.TextEvent("hello", "URControl", 2), "warning of URControl: hello"),
        (events.TextEvent("hello", "", 9), "level 9: hello"),
        (
            events.RefusedEvent((Unavailable("a", False, "IN_USE", "another client"),)),
            "not available: a (IN_USE, another client)",
        ),
        (events.OverflowEvent(1, 3), "1 sample lost, as they were not read in time (3 in all)"),
        (events.ErrorEvent("odd"), "odd"),
        (events.StartedEvent(), "started"),
        (events.PausedEvent(), "paused"),
    ],
)
def test_an_event_reads_as_a_line(event: events.RobotEvent, line: str) -> None:
    assert str(event) == line
