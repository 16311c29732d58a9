"""For how long adopted inputs keep what the robot held, while nobody owns them."""

from __future__ import annotations

from dataclasses import replace

from gatewayd.core.admission import Change
from gatewayd.core.adoption import Adoption, AdoptionStep, adopted, named, would_fall_back
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.events import EventKind
from gatewayd.core.image import ProcessImage
from gatewayd.core.requester import Requester
from gatewayd.core.succession import succeed

START, LAMP, PART, FORCE, SPEED, PATH = range(6)
PLC, HMI = range(2)
HELD = {START: True, LAMP: True, PART: 7, FORCE: 99.0, SPEED: 0.0, PATH: 7}
"""What the robot holds: of start, lamp and force the fallback would change something."""


def connected(definition: CellDefinition, now: float = 0.0) -> Cell:
    cell = Cell(definition)
    cell.robot_connected(now)
    cell.adopt(HELD, now)
    return cell


def test_it_counts_once_from_when_a_writer_could_claim() -> None:
    adoption = Adoption(10.0)
    assert adoption.look(0.0, adopted=True) is AdoptionStep.NOTHING
    adoption.reachable = True
    assert adoption.look(1.0, adopted=False) is AdoptionStep.NOTHING
    assert adoption.left(1.0) == 0.0
    assert adoption.look(2.0, adopted=True) is AdoptionStep.BEGIN
    assert adoption.left(5.0) == 7.0
    assert adoption.look(11.9, adopted=False) is AdoptionStep.NOTHING
    assert adoption.look(12.0, adopted=False) is AdoptionStep.END
    assert adoption.look(99.0, adopted=True) is AdoptionStep.NOTHING
    assert adoption.left(99.0) == 0.0


def test_none_means_for_good() -> None:
    adoption = Adoption(None)
    adoption.reachable = True
    assert adoption.look(1e9, adopted=True) is AdoptionStep.NOTHING
    assert adoption.left(1e9) == 0.0


def test_what_nobody_claims_falls_back_with_a_warning_before(press: CellDefinition) -> None:
    """A hold stays what it is, and so does what somebody owns."""
    cell = connected(replace(press, adopt_for=10.0))
    cell.adoption.reachable = True
    cell.tick(1.0)
    assert cell.health.adoption == 10.0
    (warning,) = [event for event in cell.events if event.kind is EventKind.ADOPTION_ENDS]
    assert warning.detail == "in 10 s, without an owner by then: start, lamp, force"
    assert cell.write(Requester(PLC), [Change(LAMP, value=True)], 7.0) is None
    cell.tick(10.9)
    assert cell.image.values[:4] == [True, True, 7, 99.0]
    cell.tick(11.0)
    assert cell.image.values[:4] == [False, True, 7, 10.0]
    assert cell.health.adoption == 0.0
    assert START in cell.delivery.under_way


def test_an_owner_keeps_what_it_claimed(press: CellDefinition) -> None:
    cell = connected(replace(press, adopt_for=10.0))
    cell.adoption.reachable = True
    cell.tick(1.0)
    assert cell.request(Requester(PLC), START, 5.0) is None
    cell.tick(20.0)
    assert cell.image.values[START] is True


def test_the_group_of_a_dead_writer_is_not_inherited(press: CellDefinition) -> None:
    """The new owner's path would run at the speed that another one left in the robot."""
    cell = Cell(press)
    cell.robot_connected(0.0)
    cell.adopt({SPEED: 0.9, PATH: 3}, 0.5)
    assert cell.write(Requester(HMI), [Change(PATH, 5)], 1.0) is None
    assert (cell.image.values[SPEED], cell.image.values[PATH]) == (0.0, 5)
    assert SPEED in cell.delivery.under_way
    assert cell.write(Requester(HMI), [Change(SPEED, 0.2)], 1.1) is None
    assert (cell.image.values[SPEED], cell.image.values[PATH]) == (0.2, 5)


def test_requesting_a_group_drops_all_that_was_adopted(press: CellDefinition) -> None:
    cell = Cell(press)
    cell.robot_connected(0.0)
    cell.adopt({SPEED: 0.9, PATH: 3}, 0.5)
    assert cell.request(Requester(PLC), PATH, 1.0) is None
    assert (cell.image.values[SPEED], cell.image.values[PATH]) == (0.0, 7)


def test_the_operator_inherits_nothing_either(press: CellDefinition) -> None:
    cell = Cell(press)
    cell.robot_connected(0.0)
    cell.adopt({SPEED: 0.9, PATH: 3}, 0.5)
    assert cell.operator.force(PATH, 5, 1.0, until=9.0) is None
    assert (cell.image.values[SPEED], cell.image.values[PATH]) == (0.0, 5)


def test_a_variable_that_is_guarded_alone_is_claimed_as_it_is(press: CellDefinition) -> None:
    cell = connected(press)
    assert cell.request(Requester(HMI), FORCE, 1.0) is None
    assert cell.image.values[FORCE] == 99.0


def test_an_only_owner_goes_on_with_its_own_values(press: CellDefinition) -> None:
    """Nobody else can have left them, so a PLC that writes its group in several requests causes no step."""
    locks = tuple(replace(lock, owners=(PLC,)) for lock in press.locks)
    cell = Cell(replace(press, locks=locks))
    cell.robot_connected(0.0)
    cell.adopt({SPEED: 0.9, PATH: 3}, 0.5)
    assert cell.write(Requester(PLC), [Change(PATH, 5)], 1.0) is None
    assert cell.image.values[SPEED] == 0.9


def test_a_writer_that_outlasts_a_session_keeps_its_group(press: CellDefinition) -> None:
    cell = connected(press)
    assert cell.write(Requester(PLC), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0) is None
    cell.robot_connected(1.5)
    cell.adopt({SPEED: 0.4, PATH: 3}, 1.6)
    assert cell.write(Requester(PLC), [Change(PATH, 5)], 1.7) is None
    assert cell.image.values[SPEED] == 0.4


def test_without_anything_to_fall_back_there_is_no_warning(press: CellDefinition) -> None:
    cell = Cell(replace(press, adopt_for=10.0))
    cell.robot_connected(0.0)
    cell.adopt({START: False, LAMP: False, PART: 7, FORCE: 10.0, 4: 0.0, 5: 7}, 0.0)
    cell.adoption.reachable = True
    cell.tick(1.0)
    cell.tick(12.0)
    assert not [event for event in cell.events if event.kind in (EventKind.ADOPTION_ENDS, EventKind.FALLBACK)]
    assert not cell.delivery.under_way, "nothing is sent that changes nothing"


def test_neither_a_session_nor_a_reload_starts_it_anew(press: CellDefinition) -> None:
    """After the time, what is adopted without an owner falls back at once."""
    definition = replace(press, adopt_for=10.0)
    cell = connected(definition)
    cell.adoption.reachable = True
    cell.tick(1.0)
    cell.robot_lost("cut", 4.0)
    cell.robot_connected(5.0)
    cell.adopt(HELD, 5.0)
    cell = succeed(cell, definition, 6.0).cell
    cell.tick(10.9)
    assert cell.image.values[START] is True
    cell.tick(11.0)
    assert cell.image.values[START] is False
    assert len([event for event in cell.events if event.kind is EventKind.ADOPTION_ENDS]) == 1
    cell.robot_lost("cut", 20.0)
    cell.robot_connected(21.0)
    cell.adopt(HELD, 21.0)
    assert cell.image.values[:4] == [False, False, 7, 10.0]


def test_it_ends_while_the_robot_is_away(press: CellDefinition) -> None:
    cell = connected(replace(press, adopt_for=10.0))
    cell.adoption.reachable = True
    cell.tick(1.0)
    cell.robot_lost("cut", 4.0)
    cell.tick(11.0)
    cell.robot_connected(12.0)
    cell.adopt(HELD, 12.0)
    assert cell.image.values[START] is False


def test_names_and_texts(press: CellDefinition) -> None:
    image = ProcessImage(press.variables)
    image.values[START] = True
    assert list(would_fall_back(image, [START, LAMP, PART], unread={LAMP, PART})) == [START, LAMP]
    assert named(image, [START]) == "start"
    assert adopted(image, 3, ()) == "3 variables"
    assert adopted(image, 3, {PART, START, LAMP}) == "3 variables; not readable: start, lamp, part"
    many = ProcessImage(tuple(replace(press.variables[START], name=f"v{n}") for n in range(10)))
    assert named(many, range(10)) == "v0, v1, v2, v3, v4, v5, v6, v7 and 2 more"
    assert adopted(image, 1, ()) == "1 variable"
