from __future__ import annotations

import math
from collections.abc import Iterable

import pytest

from gatewayd.core.lag import Lag

LIMIT = 0.1


@pytest.fixture
def lag() -> Lag:
    lag = Lag(LIMIT)
    lag.package(5000.0, 100.0)
    return lag


def feed(lag: Lag, packages: Iterable[tuple[float, float]]) -> None:
    for timestamp, raw in packages:
        lag.package(timestamp, raw)
        lag.stays_late(raw)


def test_the_lag_is_what_a_package_needs_more_than_the_quickest(lag: Lag) -> None:
    assert lag.package(5000.002, 100.032) == pytest.approx(0.03, abs=1e-4)
    assert lag.package(5000.004, 99.994) == 0.0
    assert lag.package(5000.006, 100.036) == pytest.approx(0.04, abs=1e-4)


def test_the_lag_that_a_package_would_have_changes_nothing(lag: Lag) -> None:
    assert lag.of(5000.002, 100.032) == pytest.approx(0.03)
    assert lag.of(5000.002, 99.0) == 0.0
    assert lag.seconds == 0.0
    assert lag.package(5000.002, 100.032) <= 0.03 + 1e-9
    assert Lag(LIMIT).of(5000.0, 100.0) == 0.0


@pytest.mark.parametrize("drift", [-400e-6, -20e-6, 20e-6, 400e-6])
def test_clocks_that_drift_for_a_day_are_no_lag(drift: float) -> None:
    lag = Lag(LIMIT)
    assert max(lag.package(second * (1 - drift), float(second)) for second in range(86400)) < 0.001


def test_a_controller_that_booted_begins_anew(lag: Lag) -> None:
    assert lag.package(0.0, 140.0) == 0.0
    assert lag.package(0.002, 140.052) == pytest.approx(0.05, abs=1e-4)


def test_a_clock_that_creeps_is_late_whichever_way_it_creeps() -> None:
    for step in (1e-9, -1e-9):
        lag = Lag(LIMIT)
        lags = [lag.package(5000 + number * step, number * 0.002) for number in range(100)]
        assert lags[-1] > LIMIT


def test_time_without_packages_hides_no_more_than_half_the_limit(lag: Lag) -> None:
    assert lag.package(5000.0 + 86400, 100.0 + 86400 + 0.09) == pytest.approx(0.04)


def test_what_is_late_does_not_become_good_by_staying_late(lag: Lag) -> None:
    for second in range(1, 20000):
        lag.package(5000.0 + second, 100.0 + second + 3.0)
    assert lag.seconds == pytest.approx(3.0, abs=0.01)


# -- a lag that stays ------------------------------------------------------------------------------------------------


def paused(seconds: float, since: float = 100.0) -> list[tuple[float, float]]:
    """Packages of a controller whose clock stood still for 5 s."""
    return [(since + 4900 + n * 0.002, since + n * 0.002 + 5.0) for n in range(round(seconds / 0.002))]


def test_a_lag_that_stays_is_doubtful_once_a_second(lag: Lag) -> None:
    feed(lag, paused(0.5))
    assert not lag.doubtful(105.5)
    feed(lag, paused(0.6, since=100.5))
    asked = [now / 10 for now in range(1055, 1095) if lag.doubtful(now / 10)]
    assert asked == [106.0, 107.0, 108.0, 109.0]


def test_a_lag_that_grows_or_falls_is_not(lag: Lag) -> None:
    feed(lag, ((5000 + n * 0.001, 100 + n * 0.002) for n in range(2000)))
    assert lag.seconds == pytest.approx(2.0, abs=0.01)
    assert not lag.doubtful(104.0)
    feed(lag, ((5002 + n * 0.004, 104 + n * 0.002) for n in range(900)))
    assert lag.seconds == pytest.approx(0.2, abs=0.01)
    assert not lag.doubtful(105.8)


def test_a_quick_answer_proves_that_there_is_no_backlog(lag: Lag) -> None:
    feed(lag, paused(1.5))
    assert lag.probed(0.02)
    assert lag.seconds == 0.0
    assert lag.package(5001.5, 106.5) == pytest.approx(0.0, abs=0.001)


@pytest.mark.parametrize("delay", [2.6, 5.0, 60.0, math.inf, math.nan, -1.0])
def test_a_slow_answer_proves_nothing(lag: Lag, delay: float) -> None:
    feed(lag, paused(1.5))
    assert not lag.probed(delay)
    assert lag.package(5001.5, 106.5) == pytest.approx(5.0, abs=0.01)
