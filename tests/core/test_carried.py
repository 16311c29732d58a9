"""Outputs that a link of their own reports: their time and quality are theirs, not those of the robot's packages."""

from __future__ import annotations

import math

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    ValueKind,
    Variable,
)
from gatewayd.core.image import Quality

SPEED, STATE, REACHED = range(3)


@pytest.fixture
def cell() -> Cell:
    """One output of the packages, two of a link."""
    outputs = (
        Variable(1, "speed", Direction.OUTPUT, ValueKind.FLOAT, "target_speed_fraction"),
        Variable(2, "state", Direction.OUTPUT, ValueKind.INT, "panel.state", low=0, high=9, via="panel",
                 on_stale=Fallback(FallbackKind.EXCEPTION)),
        Variable(3, "reached", Direction.OUTPUT, ValueKind.BOOL, "panel.reached", via="panel"),
    )  # fmt: skip
    return Cell(CellDefinition("press", 1, outputs, (), (), 0.1))


def package(cell: Cell, now: float) -> None:
    """A package of the robot."""
    assert cell.package_arrived(now, now)
    cell.image.values[SPEED] = 0.5
    cell.outputs_written(now)


def test_packages_do_not_make_a_reported_output_good(cell: Cell) -> None:
    cell.robot_connected(1.0)
    package(cell, 1.0)
    assert cell.image.quality[SPEED] is Quality.GOOD
    assert cell.image.quality[STATE] is Quality.NEVER
    assert cell.image.age(STATE, 1.0) == math.inf


def test_a_report_has_its_own_time(cell: Cell) -> None:
    cell.robot_connected(1.0)
    cell.carried.report({STATE: 4}, 1.0)
    package(cell, 3.0)
    assert (cell.image.values[STATE], cell.image.quality[STATE]) == (4, Quality.GOOD)
    assert cell.image.age(STATE, 3.0) == 2.0
    assert STATE not in cell.image.unreadable


def test_a_report_outlives_the_session_and_not_its_link(cell: Cell) -> None:
    cell.robot_connected(1.0)
    cell.carried.report({STATE: 4, REACHED: True}, 1.0)
    package(cell, 1.0)
    cell.robot_lost("closed", 2.0)
    assert cell.image.quality[SPEED] is Quality.STALE
    assert cell.image.quality[STATE] is Quality.GOOD
    cell.carried.unreported([STATE])
    assert cell.image.quality[STATE] is Quality.STALE
    assert STATE in cell.image.unreadable
    assert cell.image.quality[REACHED] is Quality.GOOD


def test_a_forced_output_shows_the_report_afterwards(cell: Cell) -> None:
    cell.carried.report({STATE: 4}, 1.0)
    cell.operator.force(STATE, 7, 1.0, 60.0)
    cell.carried.report({STATE: 5}, 2.0)
    assert cell.image.values[STATE] == 7
    cell.operator.unforce(STATE, 3.0)
    assert (cell.image.values[STATE], cell.image.quality[STATE]) == (5, Quality.GOOD)


def test_what_the_link_carries_is_found_by_its_name(cell: Cell) -> None:
    assert cell.carried.outputs("panel") == (STATE, REACHED)
    assert cell.carried.commands("panel") == ()
