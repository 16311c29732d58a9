"""Limits of attempts, apart for connecting and for the set-up."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.rtde.api.retry import Attempts, Retry
from gatewayd.rtde.loss import LossReason


def test_attempts_are_counted_apart() -> None:
    attempts = Attempts(Retry(connect_attempts=2, setup_attempts=3))
    goes_on = [
        attempts.failed(LossReason.REFUSED, connected=False, now=0, delay=1),
        attempts.failed(LossReason.HANDSHAKE, connected=True, now=1, delay=1),
        attempts.failed(LossReason.UNANSWERED, connected=True, now=2, delay=1),
        attempts.failed(LossReason.CLOSED, connected=True, now=3, delay=1),
    ]
    assert goes_on == [True, True, True, False]
    assert not attempts.failed(LossReason.REFUSED, connected=False, now=4, delay=1)


def test_time_counts_from_the_first_failure_and_includes_the_wait() -> None:
    attempts = Attempts(Retry(connect_time=10))
    assert attempts.failed(LossReason.REFUSED, connected=False, now=100, delay=2)
    assert attempts.failed(LossReason.REFUSED, connected=False, now=108, delay=2)
    assert not attempts.failed(LossReason.REFUSED, connected=False, now=108.5, delay=2)


def test_without_limits_it_goes_on_and_without_a_retry_never() -> None:
    endless = Attempts(Retry())
    assert all(
        endless.failed(LossReason.REFUSED, connected=False, now=now, delay=1) for now in range(0, 10**6, 999)
    )
    assert not Attempts(None).failed(LossReason.CLOSED, connected=True, now=0, delay=1)


@pytest.mark.parametrize(
    "wrong", [{"connect_attempts": 0}, {"setup_attempts": -1}, {"delay": 0}, {"delay": 3}]
)
def test_limits_that_cannot_be_meant_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"attempt|delay"):
        Retry(**wrong)
