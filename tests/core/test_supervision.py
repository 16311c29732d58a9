from __future__ import annotations

import math

import pytest

from gatewayd.core.definition import OPERATOR, Lock, Writer
from gatewayd.core.supervision import DEFAULT_PATIENCE, WriterTable, patience

QUIET, WATCHED, GRACIOUS, BUSY = range(4)


@pytest.fixture
def table() -> WriterTable:
    return WriterTable(
        [
            Writer("quiet"),
            Writer("watched", timeout=1.0),
            Writer("gracious", timeout=1.0, grace=2.0),
            Writer("busy", timeout=1.0, counts_writes=True),
        ],
        [Lock("leased", (0,), (QUIET, WATCHED), lease=0.25)],
    )


def test_the_first_sign_of_life_is_news_and_the_next_is_not(table: WriterTable) -> None:
    assert table.connected(QUIET, 0.0)
    assert not table.connected(QUIET, 0.1)
    assert not table.seen(QUIET, 0.2)


def test_only_the_last_connection_of_a_living_writer_loses_it(table: WriterTable) -> None:
    table.connected(QUIET, 0.0)
    table.connected(QUIET, 0.0)
    assert not table.disconnected(QUIET, 0.5)
    assert table.disconnected(QUIET, 0.5)
    assert not table.disconnected(QUIET, 0.5)
    assert table.connections[QUIET] == 0


def test_a_writer_is_silent_after_its_time_not_at_it(table: WriterTable) -> None:
    table.connected(QUIET, 0.0)
    table.connected(WATCHED, 0.0)
    assert table.silent(1.0) == []
    assert table.silent(1.001) == [WATCHED]


def test_a_lost_writer_is_not_lost_again_by_silence_or_by_its_connections_end(table: WriterTable) -> None:
    table.connected(WATCHED, 0.0)
    assert table.lose(WATCHED)
    assert table.silent(9.0) == []
    assert not table.disconnected(WATCHED, 0.5)


def test_a_lost_writer_that_is_heard_again_is_news(table: WriterTable) -> None:
    table.connected(WATCHED, 0.0)
    table.lose(WATCHED)
    assert table.seen(WATCHED, 5.0)
    assert table.silent(5.5) == []


def test_the_shortest_limit_of_a_writer_says_how_long_its_request_may_wait() -> None:
    assert patience(Writer("quiet")) == DEFAULT_PATIENCE == 0.5
    assert patience(Writer("quiet"), [None, 3.0, 2.0]) == 2.0
    assert patience(Writer("both", timeout=3.0, heartbeat=1.0), [2.0]) == 1.0


def test_a_writer_with_grace_is_lost_when_it_has_passed(table: WriterTable) -> None:
    table.connected(GRACIOUS, 0.0)
    assert not table.disconnected(GRACIOUS, 0.5)
    assert table.gone(2.49) == []
    assert table.gone(2.5) == [GRACIOUS]
    table.connected(GRACIOUS, 2.5)
    assert table.gone(9.0) == []
    assert table.disconnected(GRACIOUS, 9.0, at_once=True)


def test_a_lost_writer_has_no_grace_to_come(table: WriterTable) -> None:
    table.connected(GRACIOUS, 0.0)
    table.disconnected(GRACIOUS, 0.5)
    table.lose(GRACIOUS)
    assert table.gone(9.0) == []
    table.connected(GRACIOUS, 9.0)
    table.lose(GRACIOUS)
    assert not table.disconnected(GRACIOUS, 9.5)
    assert table.gone(19.0) == []


def test_where_writes_count_only_they_are_signs_of_life(table: WriterTable) -> None:
    assert not table.connected(BUSY, 0.0)
    assert not table.seen(BUSY, 0.5)
    assert table.last_seen[BUSY] == -math.inf
    assert table.seen(BUSY, 0.5, wrote=True)
    assert not table.seen(BUSY, 1.4)
    assert table.silent(1.6) == [BUSY]


def test_without_a_time_out_there_is_nothing_that_only_writes_could_feed() -> None:
    table = WriterTable([Writer("one", counts_writes=True)])
    assert table.connected(0, 0.0)


@pytest.mark.parametrize(
    "length, silent_after",
    [(0.125, 1.125), (0.25, 1.25), (0.5, 2.0)],
)
def test_the_time_of_a_gap_is_no_silence(table: WriterTable, length: float, silent_after: float) -> None:
    """`watched` may hold a lock with a lease of 0.25 s: what waited for longer does not count as a sign of life."""
    table.connected(WATCHED, 0.0)
    table.gap(0.5, 0.5 + length)
    assert table.silent(silent_after) == []
    assert table.silent(silent_after + 0.001) == [WATCHED]
    assert table.last_seen[WATCHED] == 0.0, "its last sign of life was when it was"


@pytest.mark.parametrize("length, end", [(0.5, 2.5), (4.0, 6.25)])
def test_the_time_of_a_gap_is_not_taken_from_the_grace(table: WriterTable, length: float, end: float) -> None:
    table.connected(GRACIOUS, 0.0)
    table.disconnected(GRACIOUS, 0.0)
    table.gap(0.25, 0.25 + length)
    assert table.gone(end - 0.001) == []
    assert table.gone(end) == [GRACIOUS]


def test_lives_and_graces_go_on_in_a_successor(table: WriterTable) -> None:
    table.connected(GRACIOUS, 0.0)
    table.connected(WATCHED, 0.25)
    table.gap(0.5, 0.625)
    table.disconnected(GRACIOUS, 0.75)
    new = WriterTable([Writer("gracious", grace=1.0), Writer("watched", timeout=1.0)])
    new.succeed(table, {WATCHED: 1, GRACIOUS: 0, OPERATOR: OPERATOR}, 1.0)
    assert (new.alive, new.connections, new.last_seen) == ([True, True], [0, 1], [0.0, 0.25])
    assert new.gone(2.75) == [0]
    assert new.silent(1.375) == []
    assert new.silent(1.376) == [1]


@pytest.mark.parametrize("rule", [{"timeout": 0.5}, {"timeout": 2.0, "counts_writes": True}])
def test_another_rule_begins_anew_in_a_successor(table: WriterTable, rule: dict[str, float]) -> None:
    """Who was silent for longer than a time-out that was not declared then has broken nothing."""
    table.connected(WATCHED, 0.25)
    new = WriterTable([Writer("watched", **rule)])  # type: ignore[arg-type]
    new.succeed(table, {WATCHED: 0}, 1.0)
    assert new.silent(1.0 + rule["timeout"]) == []
    assert new.silent(1.001 + rule["timeout"]) == [0]
