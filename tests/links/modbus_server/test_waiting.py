from __future__ import annotations

import pytest

from gatewayd.links.modbus_server.waiting import SETTLING, WaitedInput


def test_what_was_unread_waited_until_the_socket_is_read_empty() -> None:
    waiting = WaitedInput(10.0, 15.0, unread=True)
    assert waiting.seconds(15.5) == 5.5
    waiting.drained()
    assert waiting.seconds(15.5) == 0.0


def test_what_comes_right_after_the_gap_may_have_been_under_way() -> None:
    waiting = WaitedInput(10.0, 15.0, unread=False)
    assert waiting.seconds(15.0 + SETTLING) == pytest.approx(5.0 + SETTLING)
    assert waiting.seconds(15.001 + SETTLING) == 0.0


def test_what_one_gap_left_unread_is_older_after_the_next() -> None:
    first = WaitedInput(10.0, 11.0, unread=True)
    assert WaitedInput(11.5, 12.0, unread=True, former=first).seconds(12.0) == 2.0
    first.drained()
    assert WaitedInput(11.5, 12.0, unread=True, former=first).seconds(12.0) == 0.5
