"""What waited while the process stood still counts as old, and nothing else does."""

from __future__ import annotations

from gatewayd.mqtt.waiting import FULL_READ, SETTLING, WaitedMessages


def test_nothing_waits_without_a_gap() -> None:
    waited = WaitedMessages()
    waited.read(FULL_READ)
    assert waited.seconds(5.0) == 0.0


def test_what_is_read_after_a_gap_waited_until_a_read_empties_the_socket() -> None:
    waited = WaitedMessages()
    waited.gap(10.0, 13.0)
    waited.read(FULL_READ)
    assert waited.seconds(13.5) == 3.5
    waited.read(100)
    assert waited.seconds(13.02) > 3.0, "on the way when the process went on"
    assert waited.seconds(13.0 + SETTLING + 0.01) == 0.0


def test_two_gaps_count_from_the_first_where_nothing_was_read_between() -> None:
    waited = WaitedMessages()
    waited.gap(10.0, 11.0)
    waited.gap(12.0, 13.0)
    assert waited.seconds(13.0) == 3.0
