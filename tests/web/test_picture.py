"""Colours of the picture and the reasons for them."""

from __future__ import annotations

import time

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.events import Event, EventKind
from gatewayd.core.image import Quality
from gatewayd.core.requester import Requester
from gatewayd.web.picture import RECENT, Level, gateway, robot, writers
from tests.web.press import CYCLES, HMI, LINE, PLC, SPARE

ADDRESS = "10.0.0.1:30004"


@pytest.fixture
def now() -> float:
    return time.monotonic()


def test_robot_green_needs_every_variable(cell: Cell, now: float) -> None:
    assert robot(cell, ADDRESS, "", now).words == "fresh, but 1 variable unavailable"
    cell.set_availability([SPARE], True, "", now)
    assert robot(cell, ADDRESS, "", now).level is Level.GOOD


def test_robot_red_tells_the_reason_of_the_loss_then_of_the_last_attempt(cell: Cell, now: float) -> None:
    cell.robot_lost(f"{ADDRESS}: cable pulled", now)
    node = robot(cell, ADDRESS, "", now + 5)
    assert (node.level, node.words) == (Level.BAD, "lost 5 s ago: cable pulled")
    assert robot(cell, ADDRESS, f"{ADDRESS}: refused", now + 300).words == "lost 5 min ago: refused"


def test_robot_that_was_never_there(cell: Cell, now: float) -> None:
    fresh = Cell(cell.definition)
    assert robot(fresh, ADDRESS, "", now).words == "not connected yet"
    assert robot(fresh, ADDRESS, "no route", now).words == "not connected: no route"


def test_robot_that_falls_silent_is_red(cell: Cell, now: float) -> None:
    cell.tick(now + 3)
    node = robot(cell, ADDRESS, "", now + 3)
    assert node.level is Level.BAD
    assert node.words.startswith("silent: connected, but no data comes, last news 3 s ago")


def test_robot_yellow_before_its_first_package(cell: Cell, now: float) -> None:
    cell.robot_connected(now)
    assert robot(cell, ADDRESS, "", now).level is Level.WARN


def test_gateway_tells_the_worst_first(cell: Cell, now: float) -> None:
    assert gateway(cell, (), (), now).level is Level.GOOD
    assert gateway(cell, (), ["not listening"], now).words == "not listening"
    cell.operator.force(CYCLES, 5, now, now + 60)
    assert gateway(cell, (), (), now).words == "1 value forced by the local operator"
    cell.events.append(Event(now, EventKind.READ_BACK_DIFFERS, detail="int 0: 1, not 2"))
    assert gateway(cell, (), (), now).words == "read-back differs: int 0: 1, not 2"
    assert gateway(cell, ("core",), (), now).level is Level.BAD
    assert "forced" in gateway(cell, (), (), now + 2 * RECENT).words


def test_writers_by_their_last_deeds(cell: Cell, now: float) -> None:
    plc, hmi, line = writers(cell, now)
    assert (plc.level, plc.words, plc.facts) == (Level.GOOD, "connected", "holds 2 locks")
    assert (hmi.level, hmi.words) == (Level.WARN, "refused start: never writable by this writer")
    assert (line.level, line.words) == (Level.IDLE, "has not come yet")
    assert writers(cell, now + RECENT + 1)[HMI].level is Level.GOOD
    cell.writer_disconnected(Requester(PLC), now, "closed")
    lost = writers(cell, now + 5)[PLC]
    assert (lost.level, lost.words, lost.facts) == (Level.BAD, "lost, last heard 5 s ago", "holds no lock")
    assert writers(cell, now)[LINE].facts == "holds no lock"


def test_what_the_robot_holds_colours_it(cell: Cell, now: float) -> None:
    cell.set_availability([SPARE], True, "", now)
    cell.health.unadopted = 2
    node = robot(cell, ADDRESS, "", now)
    assert (node.level, node.words) == (Level.WARN, "fresh, but what it holds is not known for 2 inputs")
    cell.health.differing = 1
    node = robot(cell, ADDRESS, "", now)
    assert (node.level, node.words) == (Level.BAD, "fresh, but it holds something else for 1 input")


def test_what_falls_back_soon_and_what_cannot_be_shown_colour_the_gateway(cell: Cell, now: float) -> None:
    cell.image.quality[CYCLES] = Quality.OUT_OF_RANGE
    node = gateway(cell, (), (), now)
    assert (node.level, node.words) == (Level.WARN, "1 value out of the range of a place")
    cell.health.adoption = 8.0
    assert gateway(cell, (), (), now).words == "adopted values without an owner fall back in 8 s"
