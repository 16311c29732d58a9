from __future__ import annotations

from gatewayd.modbus.client.backoff import Backoff


def test_pauses_grow_up_to_the_limit() -> None:
    backoff = Backoff(1.0)
    pauses = []
    for _ in range(6):
        backoff.failed(100)
        pauses.append(round(backoff.until - 100, 3))
    assert pauses == [0.1, 0.2, 0.4, 0.8, 1.0, 1.0]


def test_connection_that_was_of_use_is_opened_again_at_once() -> None:
    backoff = Backoff(1.0)
    backoff.failed(100)
    backoff.worked()
    assert backoff.until == float("-inf")
    backoff.failed(200)
    assert backoff.until == 200.1
