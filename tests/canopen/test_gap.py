"""What a gap of our own does: to the deadlines of others, and to frames that waited."""

from __future__ import annotations

import pytest

from gatewayd.canopen.dictionary import Abort, AbortCode
from gatewayd.canopen.gap import LATE_PARAMETER, Waiting, spared


def test_the_whole_time_once_and_then_only_what_the_gap_took() -> None:
    first = spared(1.0, 0.5, 0.6, 9.0, again=False)
    assert first == 9.5
    second = spared(first, 0.5, 9.3, 9.4, again=True)
    assert second == 9.5 + (9.4 - 9.3)


def test_what_is_served_after_two_gaps_may_have_waited_since_the_first() -> None:
    waiting = Waiting()
    waiting.gap(1.0, 2.0)
    waiting.gap(2.25, 3.0)
    assert waiting.seconds == 2.0
    waiting.caught_up()
    assert waiting.seconds == 0.0


def test_only_parameters_are_too_late_to_be_set() -> None:
    waiting = Waiting()
    waiting.gap(0.0, LATE_PARAMETER)
    waiting.permit(0x1017)
    waiting.gap(0.0, LATE_PARAMETER + 0.1)
    waiting.permit(0x2001)
    with pytest.raises(Abort) as caught:
        waiting.permit(0x1017)
    assert caught.value.code is AbortCode.DEVICE_STATE
