from __future__ import annotations

import pytest

from gatewayd.core.definition import Writer
from gatewayd.core.supervision import WriterTable

QUIET, WATCHED = range(2)


@pytest.fixture
def table() -> WriterTable:
    return WriterTable([Writer("quiet"), Writer("watched", timeout=1.0)])


def test_the_first_sign_of_life_is_news_and_the_next_is_not(table: WriterTable) -> None:
    assert table.connected(QUIET, 0.0)
    assert not table.connected(QUIET, 0.1)
    assert not table.seen(QUIET, 0.2)


def test_only_the_last_connection_of_a_living_writer_loses_it(table: WriterTable) -> None:
    table.connected(QUIET, 0.0)
    table.connected(QUIET, 0.0)
    assert not table.disconnected(QUIET)
    assert table.disconnected(QUIET)
    assert not table.disconnected(QUIET)
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
    assert not table.disconnected(WATCHED)


def test_a_lost_writer_that_is_heard_again_is_news(table: WriterTable) -> None:
    table.connected(WATCHED, 0.0)
    table.lose(WATCHED)
    assert table.seen(WATCHED, 5.0)
    assert table.silent(5.5) == []
