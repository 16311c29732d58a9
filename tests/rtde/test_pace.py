from __future__ import annotations

import math

import pytest

from gatewayd.rtde.pace import Pace, Statistics


@pytest.fixture
def statistics() -> Statistics:
    return Statistics()


@pytest.fixture
def pace(statistics: Statistics) -> Pace:
    """Packages every 8 ms; the first has just come."""
    one = Pace(0.008, statistics, 0.0)
    assert one.package(40.0, 0.0)
    return one


def test_regular_packages_are_neither_skipped_nor_late(pace: Pace, statistics: Statistics) -> None:
    for step in range(1, 1000):
        assert pace.package(40.0 + step * 0.008, step * 0.008 + (0.003 if step % 2 else 0.0))
    assert (statistics.packages, statistics.skipped, statistics.late) == (1000, 0, 0)


@pytest.mark.parametrize("gap", [2, 3, 12])
def test_gaps_between_timestamps_are_skipped_packages(gap: int, pace: Pace, statistics: Statistics) -> None:
    assert pace.package(40.0 + gap * 0.008, gap * 0.008)
    assert (statistics.skipped, statistics.late) == (gap - 1, 0)


@pytest.mark.parametrize("gap", [13, 50, 250])
def test_a_controller_that_sends_nothing_for_a_while_pauses_and_skips_no_packages(
    gap: int, pace: Pace, statistics: Statistics
) -> None:
    assert pace.package(40.0 + gap * 0.008, gap * 0.008)
    assert (statistics.skipped, statistics.pauses, statistics.late) == (0, 1, 0)
    assert pace.package(40.0 + (gap + 2) * 0.008, (gap + 2) * 0.008)
    assert (statistics.skipped, statistics.pauses) == (1, 1)


@pytest.mark.parametrize("gap", [2, 250])
def test_what_was_not_sent_because_we_paused_the_output_is_not_missing(
    gap: int, pace: Pace, statistics: Statistics
) -> None:
    pace.resume()
    assert pace.package(40.0 + gap * 0.008, gap * 0.008)
    assert (statistics.skipped, statistics.pauses) == (0, 0)
    assert pace.package(40.0 + (gap + 3) * 0.008, (gap + 3) * 0.008)
    assert (statistics.skipped, statistics.pauses) == (2, 0)


@pytest.mark.parametrize("gap", [3, 250])
def test_what_had_no_room_while_we_stood_still_is_not_missing(
    gap: int, pace: Pace, statistics: Statistics
) -> None:
    pace.gap(2.0)
    for step in (1, 2, 2 + gap):
        assert pace.package(40.0 + step * 0.008, 2.001)
    assert (statistics.skipped, statistics.pauses) == (0, 0)
    assert pace.package(40.0 + (4 + gap) * 0.008, 3.1)
    assert (statistics.skipped, statistics.pauses) == (1, 0)


def test_a_slow_rate_skips_several_packages_before_it_is_a_pause(statistics: Statistics) -> None:
    slow = Pace(0.1, statistics, 0.0)
    for timestamp in (40.0, 40.5, 41.1):
        assert slow.package(timestamp, timestamp - 40.0)
    assert (statistics.skipped, statistics.pauses) == (4, 1)


def test_a_package_held_up_on_the_way_is_late_once(pace: Pace, statistics: Statistics) -> None:
    pace.package(40.008, 0.030)
    for step in range(2, 5):
        pace.package(40.0 + step * 0.008, 0.030 + step * 1e-5)
    assert (statistics.skipped, statistics.late) == (0, 1)


def test_a_clock_that_runs_slow_makes_nothing_late(pace: Pace, statistics: Statistics) -> None:
    for step in range(1, 1000):
        pace.package(40.0 + step * 0.008, step * 0.0088)
    assert statistics.late == 0


def test_frequency_is_measured_over_the_last_window(pace: Pace, statistics: Statistics) -> None:
    for step in range(1, 125):
        pace.package(40.0 + step * 0.008, step * 0.008)
    pace.measure(1.0)
    assert statistics.frequency == pytest.approx(125.0)
    pace.measure(2.0)
    assert statistics.frequency == 0.0


def test_a_clock_that_stands_still_is_no_restart(pace: Pace, statistics: Statistics) -> None:
    assert pace.package(40.0, 0.008)
    assert statistics.skipped == 0


@pytest.mark.parametrize("timestamp", [0.0, 39.99, -1.0, math.nan, math.inf, 1e300])
def test_a_clock_that_goes_back_or_leaps_is_a_restart(timestamp: float, pace: Pace) -> None:
    assert not pace.package(timestamp, 0.008)


@pytest.mark.usefixtures("pace")
def test_counters_go_on_over_sessions(statistics: Statistics) -> None:
    assert Pace(0.002, statistics, 10.0).package(0.0, 10.0)
    assert statistics.packages == 2
