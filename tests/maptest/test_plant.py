"""Simulated time, and who acts in it."""

from __future__ import annotations

import pytest

from gatewayd.maptest.actions import CellNames
from gatewayd.maptest.plant import TICK, Plant
from gatewayd.service import daemon
from tests.maptest.written import plant


def test_begins_with_a_robot_and_no_writer() -> None:
    one = plant()
    assert one.now == 0.0
    assert one.cell.accepts_writes
    assert not any(one.cell.writers.alive)
    assert set(one.cell.ownership.owners) == {None}


def test_the_core_is_asked_as_often_as_by_the_daemon() -> None:
    """Said twice, so that a test of a mapping does not import the daemon."""
    assert TICK == daemon.TICK


@pytest.mark.parametrize("waits", [[0.5], [0.1] * 5, [0.001] * 500])
def test_time_adds_up(waits: list[float]) -> None:
    one = plant()
    for seconds in waits:
        one.wait(seconds)
    assert one.now == 0.5


def test_the_heartbeat_of_the_gateway_counts() -> None:
    one = plant()
    one.wait(10.0)
    assert one.cell.health.heartbeat == pytest.approx(100, abs=2)


def test_two_plants_have_nothing_in_common() -> None:
    first = plant()
    second = Plant(first.cell.definition)
    names = CellNames(first.cell.definition)
    assert first.write(names.writers["plc"], names.values({"speed": 5})) is None
    assert second.cell.image.values[names.variables["speed"]] == 0.0
