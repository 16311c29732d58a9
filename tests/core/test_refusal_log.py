from __future__ import annotations

from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.core.refusal_log import REFUSAL_INTERVAL, RefusalLog


def refusal(time: float, variable: int = 0, writer: int | None = 0, reason: Reason = Reason.HELD) -> Event:
    return Event(time, EventKind.REFUSED, variable=variable, writer=writer, reason=reason)


def test_the_first_is_told_at_once_and_equal_ones_are_counted() -> None:
    told: list[Event] = []
    log = RefusalLog(told.append)
    for step in range(50):
        log.add(refusal(step * 0.01))
    assert [(event.time, event.repeats) for event in told] == [(0.0, 0)]


def test_what_differs_in_writer_variable_or_reason_is_told() -> None:
    told: list[Event] = []
    log = RefusalLog(told.append)
    for one in (
        refusal(0.0),
        refusal(0.0, variable=1),
        refusal(0.0, writer=None),
        refusal(0.0, reason=Reason.ROBOT_LOST),
    ):
        log.add(one)
    assert len(told) == 4


def test_the_next_one_after_the_interval_carries_the_count() -> None:
    told: list[Event] = []
    log = RefusalLog(told.append)
    for time in (0.0, 1.0, 2.0, REFUSAL_INTERVAL):
        log.add(refusal(time))
    assert [event.repeats for event in told] == [0, 2]


def test_what_was_counted_is_told_even_if_no_other_follows() -> None:
    told: list[Event] = []
    log = RefusalLog(told.append)
    for time in (0.0, 1.0, 2.0):
        log.add(refusal(time))
    log.tick(REFUSAL_INTERVAL - 0.01)
    assert len(told) == 1
    log.tick(REFUSAL_INTERVAL)
    assert (told[1].time, told[1].repeats, told[1].detail) == (REFUSAL_INTERVAL, 1, "the last 8.0 s ago")
    log.tick(3 * REFUSAL_INTERVAL)
    assert len(told) == 2


def test_each_interval_tells_one_at_most_and_all_are_accounted_for() -> None:
    told: list[Event] = []
    log = RefusalLog(told.append)
    for step in range(1000):
        log.add(refusal(step * 0.05))
        log.tick(step * 0.05)
    log.tick(100.0)
    assert len(told) <= 7
    assert sum(1 + event.repeats for event in told) == 1000


def test_nothing_is_remembered_of_what_is_over() -> None:
    log = RefusalLog(lambda _: None)
    for variable in range(1000):
        log.add(refusal(0.0, variable=variable))
    log.tick(REFUSAL_INTERVAL)
    assert not log._reported
