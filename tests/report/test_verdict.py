"""How a cell is: its parts with their colours and reasons, and what keeps it from being healthy."""

from __future__ import annotations

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.events import Event, EventKind
from gatewayd.core.image import Quality
from gatewayd.core.requester import Requester
from gatewayd.links.contract import Level, LinkHealth
from gatewayd.mapping.loader import load
from gatewayd.report.verdict import PRESENT, RECENT, CellVerdict, PicturePart, gateway_part, judge
from tests.web.press import CYCLES, FORCE_LIMIT, HMI, LINE, MAPPING, PLC, SPARE, START

ADDRESS = "192.0.2.1:30004"
NOW = 10.0


@pytest.fixture
def cell() -> Cell:
    """The robot is fresh; `plc` owns start and force_limit, `hmi` was refused `start`, `spare` is unavailable."""
    plan = load(MAPPING.encode(), "press.yaml").plan
    assert plan is not None
    found = Cell(plan.cell)
    found.tick(NOW)
    found.robot_connected(NOW, "controller 5.12")
    found.set_availability([SPARE], False, "in use elsewhere", NOW)
    assert found.package_arrived(1.0, NOW)
    found.outputs_written(NOW)
    found.adopt({}, NOW)
    found.writer_connected(Requester(PLC), NOW, "127.0.0.2:1")
    found.writer_connected(Requester(HMI), NOW, "127.0.0.3:1")
    assert found.write(Requester(PLC), [Change(START, True), Change(FORCE_LIMIT, 12.5)], NOW) is None
    assert found.write(Requester(HMI), [Change(START, False)], NOW) is not None
    found.delivery.unread.clear()
    return found


def verdict(cell: Cell, now: float = NOW, why: str = "", **links: LinkHealth) -> CellVerdict:
    source = LinkHealth("Robot", problems=(why,) if why else (), figures={"address": ADDRESS})
    return judge(cell, source, links, now)


def robot(cell: Cell, now: float = NOW, why: str = "") -> PicturePart:
    return verdict(cell, now, why).robot


def gateway(
    cell: Cell, hanging: tuple[str, ...] = (), troubles: tuple[str, ...] = (), now: float = NOW
) -> PicturePart:
    return gateway_part(verdict(cell, now), hanging, troubles)


def test_robot_green_needs_every_variable(cell: Cell) -> None:
    assert robot(cell).words == "1 of 10 variables unavailable: spare"
    assert robot(cell).level is Level.WARN
    cell.set_availability([SPARE], True, "", NOW)
    cell.delivery.unread.clear()
    assert (robot(cell).level, robot(cell).words) == (Level.GOOD, "fresh and writable")
    assert verdict(cell).healthy


def test_robot_yellow_tells_what_its_link_knows(cell: Cell) -> None:
    why = "another client holds input_int_register_9: probably a URCap"
    assert robot(cell, why=why).words == f"1 of 10 variables unavailable: spare; {why}"
    assert verdict(cell, why=why).problems[-1] == why
    assert verdict(cell, why=why).unserved == ()


def test_robot_red_tells_why_and_for_how_long(cell: Cell) -> None:
    cell.robot_lost(f"{ADDRESS}: cable pulled", NOW)
    found = robot(cell, NOW + 300, "refused")
    assert found.level is Level.BAD
    assert found.words.startswith("robot not connected for 5 min: refused")
    assert found.detail == ADDRESS
    assert verdict(cell, NOW + 300, "refused").unserved == ("robot not connected for 5 min: refused",)


def test_robot_that_was_never_there(cell: Cell) -> None:
    fresh = Cell(cell.definition)
    assert robot(fresh).words == "robot not connected"
    assert robot(fresh, why="no route").words == "robot not connected: no route"


def test_robot_that_falls_silent_is_red(cell: Cell) -> None:
    cell.tick(NOW + 3)
    found = robot(cell, NOW + 3)
    assert found.level is Level.BAD
    assert found.words.startswith("robot silent for 3 s")


def test_robot_yellow_before_its_first_package(cell: Cell) -> None:
    cell.robot_connected(NOW)
    assert robot(cell).level is Level.WARN


def test_unserved_until_the_inputs_are_adopted(cell: Cell) -> None:
    cell.robot_connected(NOW)
    cell.package_arrived(5.0, NOW)
    assert verdict(cell).unserved == ("the robot's inputs are not adopted yet, nothing can be written",)
    assert robot(cell).level is Level.WARN


def test_gateway_tells_the_worst_first(cell: Cell) -> None:
    assert gateway(cell).level is Level.GOOD
    assert gateway(cell, (), ("not listening",)).words == "not listening"
    cell.operator.force(CYCLES, 5, NOW, NOW + 60)
    assert gateway(cell).words == "forced by the local operator: cycles"
    cell.events.append(Event(NOW, EventKind.READ_BACK_DIFFERS, detail="int 0: 1, not 2"))
    assert gateway(cell).words == (
        "forced by the local operator: cycles; read-back differed just now: int 0: 1, not 2"
    )
    assert not any("read-back" in problem for problem in verdict(cell).problems), "it passes by itself"
    over = "forced by the local operator: cycles; read-back differed 5 s ago: int 0: 1, not 2"
    assert gateway(cell, now=NOW + 5).words == over
    hangs = gateway(cell, ("core",), ("not listening",))
    assert hangs.level is Level.BAD
    assert hangs.words.startswith("hangs: core; forced")
    assert hangs.words.endswith("; not listening")
    assert gateway(cell, now=NOW + 2 * RECENT).words == "forced by the local operator: cycles"


def test_what_falls_back_soon_and_what_cannot_be_shown_colour_the_gateway(cell: Cell) -> None:
    cell.image.quality[CYCLES] = Quality.OUT_OF_RANGE
    found = gateway(cell)
    assert found.level is Level.WARN
    assert found.words == "1 of 10 variables with a value that a register or object cannot show: cycles"
    cell.health.adoption = 8.0
    assert gateway(cell).words.endswith("adopted values without an owner fall back in 8 s")


def test_what_the_robot_holds_colours_it(cell: Cell) -> None:
    cell.set_availability([SPARE], True, "", NOW)
    cell.delivery.unread |= {START, FORCE_LIMIT}
    unread = "what the robot holds is not known for 2 inputs: start, force_limit"
    assert (robot(cell).level, robot(cell).words) == (Level.WARN, unread)
    cell.image.quality[START] = Quality.DIFFERS
    differs = "1 of 10 variables different in the robot: start"
    assert (robot(cell).level, robot(cell).words) == (Level.BAD, f"{differs}; {unread}")


def test_writers_by_their_last_deeds(cell: Cell) -> None:
    plc, hmi, line = verdict(cell).writers
    assert (plc.level, plc.words, plc.detail) == (Level.GOOD, "connected", "holds 2 locks")
    assert (hmi.level, hmi.words) == (
        Level.WARN,
        "connected; start refused just now: never writable by this writer",
    )
    past = verdict(cell, NOW + PRESENT + 1).writers[HMI]
    assert past.level is Level.GOOD, "what is over does not outshine how it is"
    assert past.words == "connected; start refused 4 s ago: never writable by this writer"
    assert (line.level, line.words) == (Level.IDLE, "has not connected yet")
    assert verdict(cell, NOW + RECENT + 1).writers[HMI].words == "connected"
    cell.writer_disconnected(Requester(PLC), NOW, "closed")
    lost = verdict(cell, NOW + 5).writers[PLC]
    assert (lost.level, lost.words, lost.detail) == (Level.BAD, "writer plc lost for 5 s", "holds no lock")
    assert verdict(cell).writers[LINE].detail == "holds no lock"


def test_links_say_themselves_how_they_are(cell: Cell) -> None:
    well = LinkHealth("Modbus :502", Level.GOOD, "listening, 1 connection")
    ill = LinkHealth("CAN can0", Level.BAD, "absent: no such interface", "node 16", ("CAN bus absent",))
    found = verdict(cell, modbus=well, canopen=ill)
    assert found.links["modbus"] == PicturePart("Modbus :502", Level.GOOD, "listening, 1 connection")
    assert found.links["canopen"] == PicturePart(
        "CAN can0", Level.BAD, "absent: no such interface", "node 16"
    )
    assert found.problems[0] == "CAN bus absent"
    assert found.level is Level.BAD
    assert not found.unserved


def test_a_cell_is_as_bad_as_its_worst_part_and_idle_parts_do_not_count(cell: Cell) -> None:
    cell.set_availability([SPARE], True, "", NOW)
    cell.delivery.unread.clear()
    assert verdict(cell).level is Level.WARN, "a refusal"
    assert verdict(cell, NOW + RECENT + 1).level is Level.GOOD
