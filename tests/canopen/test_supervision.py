"""How a bus is judged."""

from __future__ import annotations

import errno

import pytest

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.errors import decode
from gatewayd.canopen.supervision import (
    FAILURES,
    RETRY,
    RETRY_LIMIT,
    TRANSITIONS,
    BusSignal,
    Supervisor,
    signal_of_error,
)

SEEN = [BusSignal.GONE, BusSignal.DOWN, BusSignal.OFF, BusSignal.PASSIVE, BusSignal.WARNING, BusSignal.ACTIVE]
REPORTED = [
    BusSignal.REPORTED_OFF,
    BusSignal.REPORTED_PASSIVE,
    BusSignal.REPORTED_WARNING,
    BusSignal.REPORTED_ACTIVE,
]


def after(*events: BusSignal) -> BusState:
    supervisor = Supervisor()
    for event in events:
        supervisor.feed(event)
    return supervisor.state


@pytest.mark.parametrize("event", SEEN)
def test_what_is_seen_counts_in_every_state(event: BusSignal) -> None:
    assert len({TRANSITIONS[state, event] for state in BusState}) == 1


@pytest.mark.parametrize("event", REPORTED)
@pytest.mark.parametrize("state", [BusState.ABSENT, BusState.DOWN, BusState.BUS_OFF])
def test_late_report_does_not_revive_a_bus_that_carries_nothing(state: BusState, event: BusSignal) -> None:
    assert (state, event) not in TRANSITIONS


def test_controller_gets_worse_and_better() -> None:
    assert after(BusSignal.UP) is BusState.ACTIVE
    assert after(BusSignal.UP, BusSignal.REPORTED_WARNING) is BusState.WARNING
    assert after(BusSignal.UP, BusSignal.REPORTED_WARNING, BusSignal.REPORTED_PASSIVE) is BusState.PASSIVE
    assert after(BusSignal.UP, BusSignal.REPORTED_PASSIVE, BusSignal.REPORTED_OFF) is BusState.BUS_OFF
    assert after(BusSignal.UP, BusSignal.REPORTED_OFF, BusSignal.REPORTED_RESTARTED) is BusState.ACTIVE
    assert after(BusSignal.UP, BusSignal.REPORTED_PASSIVE, BusSignal.REPORTED_ACTIVE) is BusState.ACTIVE


def test_look_that_shows_nothing_of_the_controller_leaves_the_report_standing() -> None:
    assert after(BusSignal.UP, BusSignal.REPORTED_PASSIVE, BusSignal.UP) is BusState.PASSIVE
    assert after(BusSignal.UP, BusSignal.REPORTED_OFF, BusSignal.UP) is BusState.ACTIVE


def test_only_a_change_is_one() -> None:
    supervisor = Supervisor()
    assert supervisor.feed(BusSignal.ACTIVE)
    assert not supervisor.feed(BusSignal.ACTIVE)


@pytest.mark.parametrize(
    "can_id, data, event",
    [
        (0x040, bytes(8), BusSignal.REPORTED_OFF),
        (0x100, bytes(8), BusSignal.REPORTED_RESTARTED),
        (0x204, bytes([0, 0x08, 0, 0, 0, 0, 100, 0]), BusSignal.REPORTED_WARNING),
        (0x204, bytes([0, 0x30, 0, 0, 0, 0, 130, 140]), BusSignal.REPORTED_PASSIVE),
        (0x204, bytes([0, 0x40, 0, 0, 0, 0, 1, 2]), BusSignal.REPORTED_ACTIVE),
        (0x004, bytes([0, 0x01, 0, 0, 0, 0, 0, 0]), None),
        (0x088, bytes([0, 0, 4, 0, 0, 0, 0, 0]), None),
    ],
)
def test_what_an_error_frame_reports(can_id: int, data: bytes, event: BusSignal | None) -> None:
    assert signal_of_error(decode(can_id, data)) is event


def test_what_a_failed_send_says() -> None:
    assert FAILURES[errno.ENETDOWN] is BusSignal.DOWN
    assert FAILURES[errno.ENXIO] is BusSignal.GONE
    assert FAILURES[errno.ENODEV] is BusSignal.GONE
    assert errno.ENOBUFS not in FAILURES


def test_attempts_to_open_get_rarer_up_to_a_limit() -> None:
    supervisor = Supervisor()
    now, waits = 0.0, []
    for _ in range(7):
        assert supervisor.may_open(now)
        supervisor.failed(now)
        start = now
        while not supervisor.may_open(now):
            now += 0.0125
        waits.append(round(now - start, 3))
    assert waits[0] == pytest.approx(RETRY, abs=0.02)
    assert waits == sorted(waits)
    assert waits[-1] == pytest.approx(RETRY_LIMIT, abs=0.02)


def test_after_success_the_next_attempt_waits_for_nothing() -> None:
    supervisor = Supervisor()
    supervisor.failed(1.0)
    supervisor.failed(1.1)
    supervisor.opened()
    assert supervisor.may_open(1.1)
    supervisor.failed(2.0)
    assert supervisor.may_open(2.0 + RETRY)
