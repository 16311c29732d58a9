"""Refusals in every cycle of a PLC."""

from __future__ import annotations

from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal_log import REFUSAL_INTERVAL
from gatewayd.links.robot.dashboard.reports import RefusalReports
from gatewayd.links.robot.dashboard.results import CommandResult


def refusal(time: float, variable: int = 1) -> Event:
    return Event(time, EventKind.COMMAND_REFUSED, variable=variable, writer=0)


def test_equal_refusals_are_counted_and_reported_once_in_a_while() -> None:
    reports, told = RefusalReports(), list[Event]()
    for tick in range(100):
        reports.add(refusal(tick * 0.01), CommandResult.BUSY, told.append)
    assert [event.repeats for event in told] == [0]
    reports.add(refusal(REFUSAL_INTERVAL), CommandResult.BUSY, told.append)
    assert [event.repeats for event in told] == [0, 99]


def test_another_reason_or_command_is_reported_at_once() -> None:
    reports, told = RefusalReports(), list[Event]()
    reports.add(refusal(0.0), CommandResult.BUSY, told.append)
    reports.add(refusal(0.0), CommandResult.NO_PROGRAM, told.append)
    reports.add(refusal(0.0, variable=2), CommandResult.BUSY, told.append)
    assert len(told) == 3
    reports.forget()
    reports.add(refusal(0.1), CommandResult.BUSY, told.append)
    assert len(told) == 4
