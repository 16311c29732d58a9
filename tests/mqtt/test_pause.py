"""Attempts come less and less often, and never all at once."""

from __future__ import annotations

from gatewayd.mqtt.pause import FIRST, LAST, ReconnectPause


def test_it_doubles_up_to_a_bound_and_begins_anew() -> None:
    pause = ReconnectPause(lambda: 1.0)
    assert [pause.failed() for _ in range(7)] == [0.5, 1.0, 2.0, 4.0, 8.0, LAST, LAST]
    pause.worked()
    assert pause.failed() == FIRST


def test_half_of_it_is_chance() -> None:
    assert ReconnectPause(lambda: 0.0).failed() == FIRST / 2
