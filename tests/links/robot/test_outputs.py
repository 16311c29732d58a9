"""Packages pass through the image in their order and with their own time; what is too old never looks fresh."""

from __future__ import annotations

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, ValueKind, Variable
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.links.robot.outputs import SessionOutputs

STALE_AFTER = 0.1
PERIOD = 0.002
COUNTER, PULSE = 0, 1
VARIABLES = (
    Variable(1, "counter", Direction.OUTPUT, ValueKind.INT, "output_int_register_0"),
    Variable(2, "pulse", Direction.OUTPUT, ValueKind.BOOL, "output_bit_registers0_to_31", bit=3),
)
SLOTS = {
    "timestamp": slice(0, 1),
    "output_int_register_0": slice(1, 2),
    "output_bit_registers0_to_31": slice(2, 3),
}
Seen = list[tuple[object, object]]


@pytest.fixture
def cell() -> Cell:
    """A cell whose robot is fresh at 10.0, by both clocks and its own."""
    one = Cell(CellDefinition("cell", 0, VARIABLES, (), (), STALE_AFTER))
    one.robot_connected(9.0)
    assert SessionOutputs(VARIABLES, SLOTS).show(one, (10.0, 0, 0), 10.0, 10.0)
    assert one.freshness.state is Source.FRESH
    return one


def _watch(cell: Cell) -> Seen:
    """What listeners see of the two outputs, each time that they are told."""
    seen: Seen = []

    def changed(direction: Direction) -> None:
        assert direction is Direction.OUTPUT
        seen.append((cell.image.values[COUNTER], cell.image.values[PULSE]))

    cell.listeners.append(changed)
    return seen


def test_a_pulse_of_one_cycle_reaches_the_listeners_in_order(cell: Cell) -> None:
    outputs, seen, now = SessionOutputs(VARIABLES, SLOTS), _watch(cell), 10.01
    assert outputs.show_earlier(cell, (10.002, 1, 0), now, now)
    assert outputs.show_earlier(cell, (10.004, 2, 8), now, now)
    assert outputs.show_earlier(cell, (10.006, 3, 0), now, now)
    assert outputs.show(cell, (10.008, 4, 0), now, now)
    assert seen == [(1, False), (2, True), (3, False), (4, False)]
    assert cell.health.packages == 5


def test_each_has_its_own_time(cell: Cell) -> None:
    outputs, now = SessionOutputs(VARIABLES, SLOTS), 10.06
    assert outputs.show_earlier(cell, (10.002, 1, 0), now, now)
    assert cell.image.output_time == pytest.approx(10.002, abs=1e-4)
    assert outputs.show(cell, (10.058, 2, 0), now, now)
    assert cell.image.output_time == pytest.approx(10.058, abs=1e-4)


def test_what_is_older_than_stale_after_is_not_shown_and_makes_nothing_stale(cell: Cell) -> None:
    outputs, seen, now = SessionOutputs(VARIABLES, SLOTS), _watch(cell), 10.2
    assert not outputs.show_earlier(cell, (10.002, 1, 8), now, now)
    assert cell.freshness.state is Source.FRESH
    assert seen == []
    assert outputs.show_earlier(cell, (10.15, 2, 0), now, now)
    assert seen == [(2, False)]
    assert [one.kind for one in cell.events].count(EventKind.FRESH) == 1


@pytest.mark.parametrize("stale", [Source.WAITING, Source.SILENT, Source.FROZEN, Source.LATE])
def test_nothing_earlier_makes_a_source_fresh(cell: Cell, stale: Source) -> None:
    outputs, seen = SessionOutputs(VARIABLES, SLOTS), _watch(cell)
    cell.freshness.state = stale
    assert not outputs.show_earlier(cell, (10.002, 1, 8), 10.01, 10.01)
    assert cell.freshness.state is stale
    assert seen == []


def test_packages_without_a_time_of_their_own_are_shown_by_the_newest_alone(cell: Cell) -> None:
    slots = {name: slot for name, slot in SLOTS.items() if name != "timestamp"}
    outputs, seen = SessionOutputs(VARIABLES, slots), _watch(cell)
    assert not outputs.show_earlier(cell, (0.0, 1, 8), 10.01, 10.01)
    assert outputs.show(cell, (0.0, 2, 0), 10.01, 10.01)
    assert seen == [(2, False)]


def test_a_package_that_was_shown_already_is_not_shown_again(cell: Cell) -> None:
    outputs, seen = SessionOutputs(VARIABLES, SLOTS), _watch(cell)
    assert not outputs.show_earlier(cell, (10.0, 7, 8), 10.01, 10.01)
    assert seen == []


def test_bits_are_spread_anew_after_the_source_was_stale(cell: Cell) -> None:
    outputs = SessionOutputs(VARIABLES, SLOTS)
    assert outputs.show(cell, (10.002, 1, 8), 10.002, 10.002)
    cell.tick(10.5)
    assert cell.image.values[PULSE] is False
    assert outputs.show(cell, (10.502, 1, 8), 10.502, 10.502)
    assert cell.image.values[PULSE] is True


def test_the_program_is_told_of_every_package(cell: Cell) -> None:
    outputs = SessionOutputs(VARIABLES, {**SLOTS, "runtime_state": slice(3, 4)})
    assert outputs.show_earlier(cell, (10.002, 1, 0, 2), 10.01, 10.01)
    assert cell.health.program == 2
    assert outputs.show(cell, (10.004, 1, 0, 1), 10.01, 10.01)
    assert cell.health.program == 1
