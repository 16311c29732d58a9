"""What a gap of our own does to somebody's deadline."""

from __future__ import annotations

from gatewayd.canopen.gap import spared


def test_the_whole_time_once_and_then_only_what_the_gap_took() -> None:
    first = spared(1.0, 0.5, 0.6, 9.0, again=False)
    assert first == 9.5
    second = spared(first, 0.5, 9.3, 9.4, again=True)
    assert second == 9.5 + (9.4 - 9.3)
