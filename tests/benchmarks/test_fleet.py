"""The benchmark's own programs, with few nodes: births, a restart of the broker, and an hour without it."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.benchmarks import fleet


@pytest.mark.slow
def test_no_value_of_an_hour_without_a_broker_is_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor does a restart leave a node unborn; and no sequence number is missing."""
    monkeypatch.setattr(fleet, "NODES", 20)
    monkeypatch.setattr(fleet, "AWAY", 0.0)
    with ExitStack() as stack:
        broker, host, nodes = fleet.plant(stack, tmp_path)
        table = fleet.absence(broker, host, nodes)
    print(table)
    asked, restart, away = table.rows
    assert (asked[0], restart[0], away[0]) == ("asked for", "restart", "away for an hour")
    caught_up, every = away[5].split(" values")[0].split(" of ")
    assert caught_up == every
    assert int(every.replace(",", "")) >= 20 * 60 * 11
    assert away[6] == "0"
    assert table.note.endswith("dropped: 0.")
