"""What was given to the robot in a session, and what is due to it."""

from __future__ import annotations

import math

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR, CellDefinition
from gatewayd.core.events import EventKind
from gatewayd.core.image import Quality
from gatewayd.core.requester import Requester
from gatewayd.core.succession import succeed

START, LAMP, PART, FORCE, SPEED, PATH = range(6)
PLC = Requester(0)


def write(cell: Cell, index: int, value: bool | float, now: float) -> None:
    assert cell.write(PLC, [Change(index, value)], now) is None


def again(cell: Cell, now: float) -> None:
    """Another session, in which the robot holds what it was last given."""
    held = dict(enumerate(cell.image.values[:6]))
    cell.robot_lost("cut", now)
    cell.robot_connected(now)
    cell.adopt(held, now)


def test_adopted_is_not_given_and_a_session_gives_anew(cell: Cell) -> None:
    assert not any(map(cell.delivery.is_given, range(6)))
    write(cell, PART, 7, 1.0)
    assert cell.delivery.is_given(PART)
    assert cell.delivery.given_at[PART] == 1.0
    again(cell, 2.0)
    assert not cell.delivery.is_given(PART)


def test_a_fallback_is_owed_to_the_next_session_until_it_was_delivered(cell: Cell) -> None:
    write(cell, START, True, 1.0)
    cell.release_all(PLC, 2.0)
    assert cell.delivery.take_releases() == [(START, False)]
    assert cell.delivery.take_releases() == []
    assert cell.delivery.under_way == {START}
    cell.robot_lost("cut", 2.1)
    assert cell.delivery.owed == {START}
    cell.robot_connected(3.0)
    cell.adopt({START: True}, 3.0)
    assert cell.image.values[START] is False
    assert cell.delivery.take_releases() == [(START, False)]
    cell.delivery.delivered(START)
    again(cell, 4.0)
    assert cell.delivery.take_releases() == []


def test_a_write_takes_the_place_of_what_is_due(cell: Cell) -> None:
    write(cell, START, True, 1.0)
    cell.release_all(PLC, 2.0)
    write(cell, START, True, 2.1)
    assert not cell.delivery.under_way
    again(cell, 3.0)
    assert cell.image.values[START] is True


def test_a_lock_that_was_only_requested_does_not(cell: Cell) -> None:
    """Its owner has not said what it wants; the robot must not go on with what the former owner wanted."""
    write(cell, START, True, 1.0)
    cell.release_all(PLC, 2.0)
    assert cell.request(PLC, START, 2.1) is None
    cell.robot_lost("cut", 2.2)
    cell.robot_connected(3.0)
    cell.adopt({START: True}, 3.0)
    assert cell.image.values[START] is False


def test_a_register_that_is_taken_away_is_owed_its_fallback(cell: Cell) -> None:
    write(cell, START, True, 1.0)
    cell.release_all(PLC, 2.0)
    cell.set_availability([START], False, "IN_USE", 2.1)
    assert (cell.delivery.owed, cell.delivery.under_way) == ({START}, set())
    cell.set_availability([START], True, "", 3.0)
    cell.adopt({START: True}, 3.0)
    assert cell.image.values[START] is False


def test_what_cannot_be_read_is_counted_until_it_is_given(press: CellDefinition) -> None:
    cell = Cell(press)
    cell.robot_connected(0.0)
    cell.adopt({START: True, LAMP: False}, 0.0)
    assert cell.health.unadopted == 4
    write(cell, PART, 1, 1.0)
    assert cell.health.unadopted == 3
    cell.complete([FORCE], 2.0)
    assert cell.health.unadopted == 2
    assert cell.image.values[FORCE] == 10.0
    (fallback,) = [event for event in cell.events if event.kind is EventKind.FALLBACK]
    assert (fallback.variable, fallback.old, fallback.new) == (FORCE, None, 10.0)
    cell.robot_lost("cut", 3.0)
    assert cell.health.unadopted == 0


def test_a_difference_is_a_quality_until_it_reads_back(cell: Cell) -> None:
    write(cell, PART, 7, 1.0)
    cell.read_back({PART: "sent 7, holds 99"}, (), {}, 2.0)
    cell.read_back({PART: "sent 7, holds 99"}, (), {}, 2.1)
    assert cell.image.quality[PART] is Quality.DIFFERS
    assert (cell.health.differing, cell.health.read_back_mismatches) == (1, 1)
    write(cell, PART, 8, 3.0)
    assert cell.image.quality[PART] is Quality.DIFFERS, "writing it again does not make it so"
    cell.read_back({}, (PART,), {}, 4.0)
    assert cell.image.quality[PART] is Quality.GOOD
    assert cell.health.differing == 0
    cell.read_back({PART: "again"}, (), {}, 5.0)
    assert len([event for event in cell.events if event.kind is EventKind.READ_BACK_DIFFERS]) == 1
    cell.robot_lost("cut", 6.0)
    assert cell.image.quality[PART] is Quality.STALE
    assert cell.health.differing == 0


def test_a_forced_input_that_differs_says_so(cell: Cell) -> None:
    assert cell.operator.force(PART, 7, 1.0, 100.0) is None
    assert cell.ownership.owners[cell.definition.variables[PART].lock or 0] == OPERATOR
    cell.read_back({PART: "sent 7, holds 99"}, (), {}, 2.0)
    assert cell.image.quality[PART] is Quality.DIFFERS
    cell.read_back({}, (PART,), {}, 3.0)
    assert cell.image.quality[PART] is Quality.FORCED


def test_following_is_told_at_a_bounded_rate(cell: Cell) -> None:
    for step in range(40):
        cell.read_back({}, (), {PART: step}, 1.0 + step * 0.5)
    assert cell.image.values[PART] == 39
    assert cell.image.times[PART] == 20.5
    assert len([event for event in cell.events if event.kind is EventKind.FOLLOWED]) == 2


def test_a_successor_goes_on(cell: Cell, press: CellDefinition) -> None:
    write(cell, PART, 7, 1.0)
    cell.read_back({PART: "holds 99"}, (), {}, 2.0)
    write(cell, START, True, 2.5)
    cell.release(PLC, START, 3.0)
    cell.delivery.take_releases()
    new = succeed(cell, press, 4.0).cell
    assert new.delivery.given_at[PART] == 1.0
    assert new.delivery.given_at[LAMP] == -math.inf
    assert new.delivery.under_way == {START}
    assert new.health.differing == 1
    new.read_back({}, (PART,), {}, 5.0)
    assert new.image.quality[PART] is Quality.GOOD
    assert new.health.differing == 0
