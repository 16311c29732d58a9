from __future__ import annotations

import itertools
import math

import pytest

from gatewayd.core.freshness import TRANSITIONS, Freshness, Source, SourceSignal

IGNORED = {
    (Source.LOST, SourceSignal.PROGRESS),
    (Source.LOST, SourceSignal.NO_PACKAGE),
    (Source.LOST, SourceSignal.NO_PROGRESS),
    (Source.LOST, SourceSignal.TOO_LATE),
    (Source.LOST, SourceSignal.LOST),
    (Source.WAITING, SourceSignal.CONNECTED),
    (Source.WAITING, SourceSignal.NO_PACKAGE),
    (Source.FRESH, SourceSignal.CONNECTED),
    (Source.FRESH, SourceSignal.PROGRESS),
    (Source.SILENT, SourceSignal.CONNECTED),
    (Source.SILENT, SourceSignal.NO_PACKAGE),
    (Source.FROZEN, SourceSignal.CONNECTED),
    (Source.FROZEN, SourceSignal.NO_PROGRESS),
    (Source.LATE, SourceSignal.CONNECTED),
    (Source.LATE, SourceSignal.TOO_LATE),
}
"""Pairs that change nothing."""


def test_every_pair_of_state_and_happening_is_decided() -> None:
    assert TRANSITIONS.keys().isdisjoint(IGNORED)
    assert TRANSITIONS.keys() | IGNORED == set(itertools.product(Source, SourceSignal))


def test_every_state_can_be_reached_and_every_listed_move_goes_somewhere() -> None:
    assert set(TRANSITIONS.values()) == set(Source)
    assert all(before is not after for (before, _), after in TRANSITIONS.items())


def test_only_progress_makes_fresh_and_a_loss_always_ends_it() -> None:
    assert {signal for (_, signal), after in TRANSITIONS.items() if after is Source.FRESH} == {
        SourceSignal.PROGRESS
    }
    lost = {before for (before, signal), after in TRANSITIONS.items() if after is Source.LOST}
    assert lost == set(Source) - {Source.LOST}


@pytest.fixture
def source() -> Freshness:
    source = Freshness(0.5)
    source.connected()
    return source


def test_it_waits_for_the_first_package_as_long_as_it_takes(source: Freshness) -> None:
    source.tick(1000.0)
    assert source.state is Source.WAITING


def test_it_is_fresh_until_the_very_end_of_the_time(source: Freshness) -> None:
    assert source.package(1.0, 10.0)
    states = []
    for now in (10.5, math.nextafter(10.5, 11)):
        source.tick(now)
        states.append(source.state)
    assert states == [Source.FRESH, Source.SILENT]


def test_packages_with_one_timestamp_are_frozen_then_silent_then_fresh(source: Freshness) -> None:
    states = []
    source.package(1.0, 10.0)
    for now in (10.2, 10.4, 10.6):
        assert not source.package(1.0, now)
        source.tick(now)
        states.append(source.state)
    source.tick(12.0)
    states.append(source.state)
    source.package(1.0, 12.1)
    source.tick(12.2)
    states.append(source.state)
    assert source.package(1.002, 12.3)
    states.append(source.state)
    assert states == [
        Source.FRESH, Source.FRESH, Source.FROZEN, Source.SILENT, Source.FROZEN, Source.FRESH,
    ]  # fmt: skip


def test_a_timestamp_that_goes_back_is_a_controller_that_restarted(source: Freshness) -> None:
    source.package(5000.0, 10.0)
    assert source.package(0.0, 10.1)


def test_a_recipe_without_timestamp_is_believed(source: Freshness) -> None:
    assert source.package(None, 10.0)
    assert source.package(None, 10.4)
    source.tick(10.6)
    assert source.state is Source.FRESH


def test_a_package_outside_a_session_tells_nothing(source: Freshness) -> None:
    source.lost()
    assert not source.package(1.0, 10.0)
    assert source.last_package == -math.inf


def test_reconnecting_to_a_frozen_controller_does_not_make_it_fresh(source: Freshness) -> None:
    source.package(1.0, 10.0)
    source.lost()
    source.connected()
    states = []
    for timestamp, news in ((1.0, False), (1.002, True)):
        assert source.package(timestamp, 20.0) is news
        states.append(source.state)
    assert states == [Source.FROZEN, Source.FRESH]


@pytest.mark.parametrize("lag, state", [(0.5, Source.FRESH), (0.51, Source.LATE), (60.0, Source.LATE)])
def test_a_package_is_late_beyond_the_limit(source: Freshness, lag: float, state: Source) -> None:
    assert source.package(1.0, 10.0, lag) is (state is Source.FRESH)
    assert source.state is state
    assert source.last_progress == 10.0 - lag
    assert source.last_arrival == 10.0


def test_a_late_source_is_fresh_at_half_the_limit(source: Freshness) -> None:
    source.package(1.0, 10.0, 0.6)
    assert not source.package(1.1, 10.1, 0.26)
    assert source.package(1.2, 10.2, 0.25)


def test_what_grows_too_old_before_the_next_package_is_late_silent_only_later(source: Freshness) -> None:
    states = []
    source.package(1.0, 10.0, 0.4)
    for now in (10.1, 10.11, 10.5, 10.51):
        source.tick(now)
        states.append(source.state)
    assert states == [Source.FRESH, Source.LATE, Source.LATE, Source.SILENT]


@pytest.mark.parametrize("repeated, state", [(False, Source.SILENT), (True, Source.FROZEN)])
def test_a_small_lag_is_not_what_makes_a_cut_line_stale(
    source: Freshness, repeated: bool, state: Source
) -> None:
    source.package(1.0, 10.0, 0.1)
    if repeated:
        source.package(1.0, 10.3, 0.1)
    source.tick(10.41)
    assert source.state is state


def test_a_frozen_timestamp_is_frozen_though_it_was_late_before(source: Freshness) -> None:
    states = []
    source.package(1.0, 10.0, 0.4)
    for now in (10.11, 10.3, 10.55):
        source.package(1.0, now, 0.4)
        source.tick(now)
        states.append(source.state)
    assert states == [Source.LATE, Source.LATE, Source.FROZEN]


def test_a_source_goes_on_where_its_predecessor_stood(source: Freshness) -> None:
    source.package(1.0, 10.0, 0.4)
    heir = Freshness(0.3)
    heir.succeed(source)
    assert not heir.package(1.0, 10.05)
    heir.tick(10.05)
    assert heir.state is Source.LATE
