from __future__ import annotations

from gatewayd.modbus.client.breaker import TABLE, Breaker, BreakerEvent, BreakerSettings, BreakerState

CLOSED, OPEN, PROBING = BreakerState.CLOSED, BreakerState.OPEN, BreakerState.PROBING


def closed(failures: int = 3) -> Breaker:
    breaker = Breaker(BreakerSettings(failures=failures, probe_every=2.0))
    breaker.probe()
    breaker.answered()
    return breaker


def test_every_state_can_be_reached_and_left() -> None:
    assert {state for state, _ in TABLE} == set(BreakerState) == set(TABLE.values())
    assert {event for _, event in TABLE} == set(BreakerEvent)


def test_unit_that_was_never_there_is_probed_at_once() -> None:
    breaker = Breaker(BreakerSettings())
    assert (breaker.state, breaker.probe_at) == (OPEN, float("-inf"))


def test_it_opens_after_so_many_failures_in_a_row() -> None:
    breaker = closed()
    breaker.failed(1)
    breaker.failed(2)
    breaker.answered()
    breaker.failed(3)
    breaker.failed(4)
    assert breaker.state is CLOSED
    breaker.failed(5)
    assert (breaker.state, breaker.probe_at) == (OPEN, 7)


def test_probe_decides() -> None:
    breaker = closed(1)
    breaker.failed(5)
    breaker.probe()
    assert breaker.state is PROBING
    breaker.failed(8)
    assert (breaker.state, breaker.probe_at) == (OPEN, 10)
    breaker.probe()
    breaker.answered()
    assert (breaker.state, breaker.failures) == (CLOSED, 0)


def test_probe_that_was_lost_with_the_connection_may_be_repeated_at_once() -> None:
    breaker = Breaker(BreakerSettings())
    breaker.probe()
    breaker.probe_lost(4)
    assert (breaker.state, breaker.probe_at, breaker.failures) == (OPEN, 4, 0)


def test_answer_that_comes_while_it_is_open_closes_it() -> None:
    breaker = closed(1)
    breaker.failed(1)
    breaker.answered()
    assert breaker.is_closed
