"""When a command acts, case by case; `test_commands_properties` tries any interleaving."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.commands import Attempt, Obstacle
from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Lock,
    Value,
    ValueKind,
    Variable,
    Writer,
)
from gatewayd.core.prepared import PreparedWrite
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.core.succession import succeed

PLAY, LOAD, OTHER = 0, 1, 2
PLC, HMI = Requester(0, connection=1), Requester(1, connection=2)
VIA = "panel"


def definition(*, lease: float | None = None) -> CellDefinition:
    """Two commands that two writers may own, and an input beside them."""
    inputs = (
        Variable(1, "play", Direction.INPUT, ValueKind.BOOL, "panel.play", lock=0, via=VIA),
        Variable(2, "load", Direction.INPUT, ValueKind.INT, "panel.load", low=0, high=9, lock=1, via=VIA),
        Variable(3, "other", Direction.INPUT, ValueKind.BOOL, "input_bit_registers0_to_31", bit=0, lock=2),
    )
    locks = tuple(Lock(each.name, (n,), (0, 1), takeover=True, lease=lease) for n, each in enumerate(inputs))
    return CellDefinition("press", 1, inputs, locks, (Writer("plc", grace=1.0), Writer("hmi")), 0.1)


class Rig:
    """A cell whose robot and link are there, and the commands that acted or did not."""

    def __init__(self, cell: Cell) -> None:
        self.attempts: list[Attempt] = []
        self.cell = cell
        cell.commands.listeners.append(self.attempts.append)

    def write(
        self, value: Value, requester: Requester = PLC, variable: int = PLAY, *, implied: bool = False
    ) -> None:
        assert self.cell.write(requester, [Change(variable, value, implied)], 1.0) is None

    def taken(self) -> list[Obstacle | None]:
        """What came of the attempts since the last call."""
        found = [attempt.obstacle for attempt in self.attempts]
        self.attempts.clear()
        return found


def robot_up(cell: Cell, now: float = 0.0) -> None:
    """A session begins; its inputs are adopted."""
    cell.robot_connected(now)
    cell.adopt({OTHER: False}, now)


@pytest.fixture
def rig() -> Rig:
    """Everything there, nobody has written."""
    cell = Cell(definition(lease=5.0))
    cell.carried.begin(VIA, 0.0)
    robot_up(cell)
    return Rig(cell)


def test_a_command_acts_once_on_each_explicit_rise(rig: Rig) -> None:
    for _ in range(2):
        rig.write(False)
        rig.write(True)
        assert rig.taken() == [None]
        rig.write(True)
        assert rig.taken() == []


def test_what_was_not_cleared_does_not_act_and_says_so_once(rig: Rig) -> None:
    rig.write(True)
    assert rig.taken() == [Obstacle.NOT_CLEARED]
    rig.write(True)
    assert rig.taken() == []


def test_a_number_acts_from_zero_alone(rig: Rig) -> None:
    rig.write(0, variable=LOAD)
    rig.write(2, variable=LOAD)
    assert [(each.value, each.obstacle) for each in rig.attempts] == [(2, None)]
    rig.attempts.clear()
    rig.write(3, variable=LOAD)
    assert rig.taken() == [Obstacle.NOT_CLEARED]


def _taken_over(rig: Rig) -> None:
    rig.cell.release_all(PLC, 1.0)
    rig.write(False, HMI)
    rig.write(False, PLC)
    assert rig.cell.ownership.owners[PLAY] == PLC.writer
    rig.cell.release_all(PLC, 1.0)


def _requested(rig: Rig) -> None:
    assert rig.cell.release(PLC, PLAY, 1.0) is None
    assert rig.cell.request(PLC, PLAY, 1.0) is None


def _other_connection(rig: Rig) -> None:
    rig.cell.writer_connected(replace(PLC, connection=7), 1.0)
    rig.cell.writer_disconnected(PLC, 1.0, "closed")


def _session(rig: Rig) -> None:
    rig.cell.robot_lost("closed", 1.0)
    robot_up(rig.cell, 1.0)


def _link(rig: Rig) -> None:
    rig.cell.carried.end(VIA, "closed", 1.0)
    rig.cell.carried.begin(VIA, 1.0)


def _operator(rig: Rig) -> None:
    rig.cell.operator.take_lock(PLAY, 1.0)
    rig.cell.operator.free_lock(PLAY, 1.0)


BETWEEN: dict[str, tuple[Callable[[Rig], None], Requester]] = {
    "takeover": (_taken_over, HMI),
    "release": (lambda rig: rig.cell.release_all(PLC, 1.0), PLC),
    "a request for the lock after its release": (_requested, PLC),
    "reconnect of the writer": (_other_connection, replace(PLC, connection=7)),
    "another session": (_session, PLC),
    "another connection of the link": (_link, PLC),
    "the operator takes it": (_operator, PLC),
    "the gateway stood still": (lambda _: None, replace(PLC, waited=0.6)),
}


@pytest.mark.parametrize("between", BETWEEN)
def test_nothing_acts_when_something_came_between_0_and_1(rig: Rig, between: str) -> None:
    happens, requester = BETWEEN[between]
    rig.write(False)
    happens(rig)
    rig.write(True, requester)
    (obstacle,) = rig.taken()
    assert obstacle is not None


def test_the_other_writers_zero_does_not_count(rig: Rig) -> None:
    rig.write(False, HMI)
    rig.write(True, PLC)
    assert rig.taken() == [Obstacle.NOT_CLEARED]


def test_implied_bits_neither_act_nor_clear(rig: Rig) -> None:
    rig.write(False)
    rig.write(True, implied=True)
    assert rig.taken() == [Obstacle.IMPLIED]
    rig.write(False, implied=True)
    rig.write(True)
    assert rig.taken() == [Obstacle.NOT_CLEARED]


def test_a_reload_forgets_what_was_written(rig: Rig) -> None:
    rig.write(False)
    later = Rig(succeed(rig.cell, definition(lease=5.0), 1.0).cell)
    later.write(True)
    assert later.taken() == [Obstacle.NOT_CLEARED]


def test_a_command_cannot_be_forced(rig: Rig) -> None:
    rig.write(False)
    refusal = rig.cell.operator.force(PLAY, True, 1.0, 60.0)
    assert refusal is not None
    assert refusal.reason is Reason.NOT_WRITABLE
    assert rig.cell.image.values[PLAY] is False
    assert rig.taken() == []


def test_a_session_finds_its_commands_at_rest(rig: Rig) -> None:
    rig.write(False)
    rig.write(True)
    rig.cell.robot_lost("closed", 1.0)
    robot_up(rig.cell, 1.0)
    assert rig.cell.image.values[PLAY] is False
    assert rig.cell.health.unadopted == 0


def test_a_released_command_is_owed_to_nobody(rig: Rig) -> None:
    rig.write(False)
    rig.write(True)
    rig.cell.release_all(PLC, 1.0)
    assert rig.cell.image.values[PLAY] is False
    assert not rig.cell.delivery.under_way
    rig.cell.robot_lost("closed", 1.0)
    assert not rig.cell.delivery.owed


def test_a_command_is_refused_while_its_link_or_the_robot_is_away(rig: Rig) -> None:
    rig.cell.carried.end(VIA, "closed", 1.0)
    refusal = rig.cell.write(PLC, [Change(PLAY, value=False)], 1.0)
    assert refusal is not None
    assert refusal.reason is Reason.CLAIMED_ELSEWHERE
    rig.cell.robot_lost("closed", 1.0)
    refusal = rig.cell.write(PLC, [Change(PLAY, value=False)], 1.0)
    assert refusal is not None
    assert refusal.reason is Reason.ROBOT_LOST


def test_the_quick_way_has_no_commands(rig: Rig) -> None:
    with pytest.raises(ValueError, match="command"):
        PreparedWrite(rig.cell, [OTHER, PLAY])


def test_a_command_that_a_mapping_drops_leaves_nothing_behind(rig: Rig) -> None:
    rig.write(False)
    rig.write(True)
    rig.cell.robot_lost("closed", 1.0)
    old = definition()
    without = replace(old, variables=old.variables[1:], locks=())
    assert succeed(rig.cell, without, 1.0).stranded == ()
