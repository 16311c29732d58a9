from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import (
    OPERATOR,
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Value,
    Writer,
)
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.health import HEARTBEAT_PERIOD
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester

PLC, HMI, AUX = range(3)
START, LAMP, PART, FORCE, SPEED, PATH, CYCLES, LEVEL, MODE, ALARM = range(10)
INPUTS = range(START, CYCLES)
OUTPUTS = range(CYCLES, ALARM + 1)
Connect = Callable[[Cell, float], None]


def told(cell: Cell, kind: EventKind) -> list[Event]:
    return [event for event in cell.events if event.kind is kind]


def owner(cell: Cell, lock: int) -> int | None:
    return cell.ownership.owners[lock]


def quality(cell: Cell, variable: int) -> Quality:
    return cell.image.quality[variable]


def write(cell: Cell, writer: int | None, variable: int, value: Value, now: float) -> Refusal | None:
    return cell.write(Requester(writer), [Change(variable, value)], now)


# -- writing -----------------------------------------------------------------------------------------------------


def test_a_write_takes_the_lock_and_sets_value_time_and_quality(cell: Cell) -> None:
    assert write(cell, PLC, PART, 12, 1.5) is None
    assert (cell.image.values[PART], cell.image.times[PART], cell.image.quality[PART]) == (
        12,
        1.5,
        Quality.GOOD,
    )
    assert owner(cell, 2) == PLC
    assert cell.health.writes_accepted == 1


def test_a_refused_request_changes_neither_values_nor_locks(cell: Cell) -> None:
    before = list(cell.image.values)
    refusal = cell.write(Requester(HMI), [Change(PART, 9), Change(FORCE, 20.0), Change(START, True)], 1.0)
    assert refusal == Refusal(Reason.NOT_WRITABLE, START)
    assert cell.image.values == before
    assert cell.ownership.owners == [None] * 5


@pytest.mark.parametrize("changes", [[Change(PART, 1)], [Change(START, False, implied=True)]])
def test_an_undeclared_peer_may_write_nothing_not_even_what_is_there(
    cell: Cell, changes: list[Change]
) -> None:
    refusal = cell.write(Requester(None), changes, 1.0)
    assert refusal is not None
    assert refusal.reason is Reason.NOT_WRITABLE
    assert cell.health.writes_refused == 1


def test_an_output_is_writable_by_nobody(cell: Cell) -> None:
    assert write(cell, PLC, CYCLES, 1, 1.0) == Refusal(Reason.NOT_WRITABLE, CYCLES)


def test_the_last_of_two_values_for_one_variable_counts(cell: Cell) -> None:
    assert cell.write(Requester(PLC), [Change(PART, 1), Change(PART, 2)], 1.0) is None
    assert cell.image.values[PART] == 2


def test_a_held_variable_names_its_holder(cell: Cell) -> None:
    write(cell, HMI, PART, 1, 1.0)
    assert write(cell, PLC, PART, 2, 1.5) == Refusal(Reason.HELD, PART, HMI)


def test_a_lease_ends_exactly_at_its_time_without_a_tick(cell: Cell) -> None:
    write(cell, HMI, PART, 1, 1.0)
    assert write(cell, PLC, PART, 2, math.nextafter(3.0, 0)) is not None
    assert write(cell, PLC, PART, 2, 3.0) is None


def test_values_of_one_request_are_told_to_the_listeners_at_once(cell: Cell) -> None:
    seen: list[tuple[Direction, list[Value]]] = []
    cell.listeners.append(lambda direction: seen.append((direction, cell.image.values[START:CYCLES])))
    cell.write(Requester(PLC), [Change(START, True), Change(PART, 3), Change(SPEED, 0.5)], 1.0)
    assert seen == [(Direction.INPUT, [True, False, 3, 0.0, 0.5, 7])]


def test_a_nan_passes_only_where_no_limits_are_and_falls_back_like_any_value(
    press: CellDefinition, connect: Connect
) -> None:
    speed = replace(press.variables[SPEED], limits=None)
    free = Cell(replace(press, variables=(*press.variables[:SPEED], speed, *press.variables[SPEED + 1 :])))
    connect(free, 0.0)
    assert write(free, PLC, SPEED, math.nan, 1.0) is None
    assert write(free, PLC, FORCE, math.nan, 1.0) == Refusal(Reason.OUT_OF_LIMITS, FORCE)
    free.release(Requester(PLC), SPEED, 1.5)
    assert free.image.values[SPEED] == 0.0


def test_a_held_nan_is_no_change(press: CellDefinition, connect: Connect) -> None:
    speed = replace(press.variables[SPEED], limits=None, on_release=Fallback(FallbackKind.HOLD))
    free = Cell(replace(press, variables=(*press.variables[:SPEED], speed, *press.variables[SPEED + 1 :])))
    connect(free, 0.0)
    write(free, PLC, SPEED, math.nan, 1.0)
    free.release(Requester(PLC), SPEED, 1.5)
    assert [event.variable for event in told(free, EventKind.FALLBACK)] == [PATH]
    assert free.image.times[SPEED] == 1.0


# -- implied bits ------------------------------------------------------------------------------------------------


def word(start: bool, lamp: bool) -> list[Change]:
    """The register that `start` (plc) and `lamp` (plc before hmi) share, written whole."""
    return [Change(START, start, implied=True), Change(LAMP, lamp, implied=True)]


def test_an_implied_bit_that_only_one_may_own_is_taken_and_written(cell: Cell) -> None:
    assert cell.write(Requester(PLC), word(True, False), 1.0) is None
    assert cell.ownership.owners[:2] == [PLC, None]
    assert cell.image.values[START] is True


def test_an_implied_bit_of_somebody_else_may_pass_unchanged(cell: Cell) -> None:
    write(cell, PLC, START, True, 1.0)
    write(cell, HMI, LAMP, False, 1.0)
    assert cell.write(Requester(HMI), word(True, True), 1.5) is None
    assert cell.ownership.owners[:2] == [PLC, HMI]
    assert cell.image.times[START] == 1.0


def test_a_word_read_before_a_bit_was_stopped_does_not_bring_it_back(cell: Cell) -> None:
    """The HMI jogs and is lost, the PLC writes the word that it has read before, for a bit of its own."""
    connected = Requester(HMI, connection=7)
    cell.writer_connected(connected, 0.5)
    assert cell.write(connected, [Change(LAMP, True)], 1.0) is None
    stale = cell.image.values[LAMP]
    cell.writer_disconnected(connected, 1.1, "cable")
    assert cell.image.values[LAMP] is False
    assert cell.write(Requester(PLC), word(True, bool(stale)), 1.2) == Refusal(Reason.NOT_MEANT, LAMP)
    assert cell.image.values[START : LAMP + 1] == [False, False]
    assert cell.ownership.owners[:2] == [None, None]
    assert cell.write(Requester(PLC), word(True, False), 1.3) is None
    assert cell.image.values[START : LAMP + 1] == [True, False]


def test_a_word_read_before_its_owner_cleared_a_bit_does_not_take_it_over(cell: Cell) -> None:
    """The HMI clears what it jogs; the stale word of the PLC, which ranks above it, must not set it again."""
    write(cell, HMI, LAMP, True, 1.0)
    write(cell, HMI, LAMP, False, 1.1)
    assert cell.write(Requester(PLC), word(True, True), 1.2) == Refusal(Reason.NOT_MEANT, LAMP)
    assert owner(cell, 1) == HMI
    assert write(cell, HMI, LAMP, False, 1.3) is None, "the next stop is not refused"
    assert write(cell, PLC, LAMP, True, 1.4) is None, "taken on purpose"
    assert cell.write(Requester(PLC), word(True, False), 1.5) is None, "and then written with the word"
    assert cell.image.values[LAMP] is False


def test_an_implied_changed_bit_that_the_writer_may_never_write_refuses_all(cell: Cell) -> None:
    refusal = cell.write(
        Requester(HMI), [Change(START, True, implied=True), Change(LAMP, True, implied=True)], 1.0
    )
    assert refusal == Refusal(Reason.NOT_WRITABLE, START)
    assert cell.image.values[LAMP] is False


def test_an_implied_bit_of_a_higher_owner_must_keep_its_value(cell: Cell) -> None:
    write(cell, PLC, LAMP, True, 1.0)
    assert cell.write(Requester(HMI), [Change(LAMP, True, implied=True)], 1.5) is None
    assert cell.write(Requester(HMI), [Change(LAMP, False, implied=True)], 1.5) == Refusal(
        Reason.HELD, LAMP, PLC
    )
    assert owner(cell, 1) == PLC
    assert cell.image.values[LAMP] is True


def test_an_implied_bit_of_a_robot_output_may_pass_unchanged(cell: Cell) -> None:
    assert cell.write(Requester(PLC), [Change(ALARM, True, implied=True), Change(START, True)], 1.0) is None
    assert cell.write(Requester(PLC), [Change(ALARM, False, implied=True)], 1.0) == Refusal(
        Reason.NOT_WRITABLE, ALARM
    )


def test_an_implied_unchanged_bit_in_a_register_that_is_gone_is_let_pass(cell: Cell) -> None:
    cell.set_availability([LAMP], False, "claimed", 1.0)
    assert (
        cell.write(
            Requester(PLC), [Change(START, True, implied=True), Change(LAMP, False, implied=True)], 1.0
        )
        is None
    )
    assert cell.ownership.owners[:2] == [PLC, None]


# -- taking over -------------------------------------------------------------------------------------------------


def fallbacks(cell: Cell) -> list[tuple[int | None, Value | None, Value | None]]:
    return [(event.variable, event.old, event.new) for event in told(cell, EventKind.FALLBACK)]


def test_a_group_is_taken_over_as_a_whole_and_nothing_is_inherited(cell: Cell) -> None:
    """The former owner's speed must not drive the new one's path."""
    seen: list[list[Value]] = []
    cell.write(Requester(HMI), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0)
    cell.listeners.append(lambda _direction: seen.append(cell.image.values[SPEED : PATH + 1]))
    assert write(cell, PLC, PATH, 4, 1.5) is None
    assert seen == [[0.0, 4]], "in one package"
    assert write(cell, HMI, SPEED, 0.1, 1.6) == Refusal(Reason.HELD, SPEED, PLC)
    (event,) = told(cell, EventKind.TAKEN_OVER)
    assert (event.lock, event.writer, event.other) == (4, PLC, HMI)
    assert fallbacks(cell) == [(SPEED, 0.4, 0.0)]


def test_a_member_that_holds_keeps_its_value_in_a_takeover(press: CellDefinition, connect: Connect) -> None:
    speed = replace(press.variables[SPEED], on_release=Fallback(FallbackKind.HOLD))
    cell = Cell(replace(press, variables=(*press.variables[:SPEED], speed, *press.variables[SPEED + 1 :])))
    connect(cell, 0.0)
    cell.write(Requester(HMI), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0)
    assert write(cell, PLC, PATH, 4, 1.5) is None
    assert cell.image.values[SPEED : PATH + 1] == [0.4, 4]


def test_a_takeover_by_request_drops_every_member(cell: Cell) -> None:
    cell.write(Requester(HMI), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0)
    seen: list[list[Value]] = []
    cell.listeners.append(lambda _direction: seen.append(cell.image.values[SPEED : PATH + 1]))
    assert cell.request(Requester(PLC), PATH, 1.5) is None
    assert seen == [[0.0, 7]]
    assert fallbacks(cell) == [(SPEED, 0.4, 0.0), (PATH, 3, 7)]
    assert cell.request(Requester(PLC), PATH, 1.6) is None
    assert len(seen) == 1, "renewing changes nothing"


def test_acquiring_a_free_lock_changes_nothing_that_was_given_in_this_session(cell: Cell) -> None:
    cell.write(Requester(HMI), [Change(SPEED, 0.4), Change(PATH, 3)], 0.5)
    assert cell.release(Requester(HMI), PATH, 0.6) is None
    before = fallbacks(cell)
    assert cell.request(Requester(HMI), PATH, 1.0) is None
    assert write(cell, HMI, PATH, 4, 1.1) is None
    assert cell.image.values[SPEED : PATH + 1] == [0.0, 4]
    assert fallbacks(cell) == before


def test_what_a_takeover_drops_waits_for_its_register(cell: Cell) -> None:
    cell.write(Requester(HMI), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0)
    cell.set_availability([SPEED], False, "claimed", 1.1)
    assert write(cell, PLC, PATH, 4, 1.5) is None
    assert cell.image.values[SPEED] == 0.4
    cell.set_availability([SPEED], True, "freed", 2.0)
    cell.adopt({SPEED: 0.4}, 2.0)
    assert cell.image.values[SPEED] == 0.0


def test_a_takeover_by_request_without_a_robot_drops_when_it_is_back(cell: Cell) -> None:
    cell.write(Requester(HMI), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0)
    cell.robot_lost("cable", 1.1)
    assert cell.request(Requester(PLC), PATH, 1.2) is None
    cell.robot_connected(2.0)
    cell.adopt({SPEED: 0.4, PATH: 3}, 2.0)
    assert cell.image.values[SPEED : PATH + 1] == [0.0, 7]


def test_a_list_without_takeover_keeps_its_holder(cell: Cell) -> None:
    cell.request(Requester(HMI), PART, 1.0)
    assert cell.request(Requester(PLC), PART, 1.5) == Refusal(Reason.HELD, PART, HMI)


# -- refusals for the robot's sake -------------------------------------------------------------------------------


def test_a_write_refused_for_the_robots_sake_renews_the_lease(cell: Cell) -> None:
    write(cell, PLC, PART, 5, 1.0)
    cell.robot_lost("unplugged", 1.5)
    assert write(cell, PLC, PART, 6, 2.5) == Refusal(Reason.ROBOT_LOST, PART)
    cell.tick(3.5)
    assert owner(cell, 2) == PLC
    cell.tick(4.5)
    assert owner(cell, 2) is None


def test_a_write_refused_for_the_robots_sake_takes_nothing(cell: Cell) -> None:
    cell.request(Requester(HMI), LAMP, 0.5)
    cell.robot_lost("unplugged", 1.0)
    for variable, value in ((LAMP, True), (FORCE, 1.0)):
        assert write(cell, PLC, variable, value, 1.0) == Refusal(Reason.ROBOT_LOST, variable)
    assert owner(cell, 1) == HMI
    assert owner(cell, 3) is None


def test_a_write_refused_for_its_value_renews_nothing(cell: Cell) -> None:
    write(cell, PLC, SPEED, 0.5, 1.0)
    assert write(cell, PLC, SPEED, 2.0, 2.0) == Refusal(Reason.OUT_OF_LIMITS, SPEED)
    assert cell.ownership.remaining(4, 2.0) == 1.0


def test_a_register_claimed_elsewhere_costs_what_depends_on_it(cell: Cell) -> None:
    cell.set_availability([PART], False, "claimed", 1.0)
    assert write(cell, PLC, PART, 1, 1.0) == Refusal(Reason.CLAIMED_ELSEWHERE, PART)
    assert write(cell, PLC, FORCE, 1.0, 1.0) is None


# -- a writer that is not heard ----------------------------------------------------------------------------------


def test_what_is_not_heard_moves_no_lock_and_makes_nobody_alive(cell: Cell) -> None:
    assert cell.write(Requester(PLC, trusted=False), [Change(PART, 5)], 1.0) == Refusal(
        Reason.HEARTBEAT_LOST, PART
    )
    assert cell.request(Requester(PLC, trusted=False), PART, 1.0) == Refusal(Reason.HEARTBEAT_LOST, PART)
    assert cell.release(Requester(PLC, trusted=False), PART, 1.0) == Refusal(Reason.HEARTBEAT_LOST, PART)
    assert owner(cell, 2) is None
    assert not cell.writers.alive[PLC]
    assert cell.image.values[PART] != 5
    assert cell.health.writes_refused == 3
    assert [event.reason for event in told(cell, EventKind.REFUSED)] == [Reason.HEARTBEAT_LOST]


def test_what_is_not_heard_neither_renews_nor_gives_back_what_another_link_holds(cell: Cell) -> None:
    write(cell, PLC, PART, 5, 1.0)
    for now, lost in ((2.0, False), (2.5, True)):
        if lost:
            cell.robot_lost("unplugged", now)
        refusal = cell.write(Requester(PLC, trusted=False), [Change(PART, 6)], now)
        assert refusal == Refusal(Reason.HEARTBEAT_LOST, PART)
    assert cell.release(Requester(PLC, trusted=False), PART, 2.5) is not None
    assert owner(cell, 2) == PLC
    cell.tick(3.0)
    assert owner(cell, 2) is None, "the lease of its last accepted write has ended"


def test_who_may_never_own_it_is_told_that_first(cell: Cell) -> None:
    assert cell.request(Requester(HMI, trusted=False), START, 1.0) == Refusal(Reason.NOT_WRITABLE, START)


# -- releasing ---------------------------------------------------------------------------------------------------


def test_a_release_applies_every_members_policy(cell: Cell) -> None:
    cell.write(Requester(PLC), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0)
    assert cell.release(Requester(PLC), SPEED, 1.5) is None
    assert cell.image.values[SPEED : PATH + 1] == [0.0, 7]
    assert [(event.variable, event.old, event.new) for event in told(cell, EventKind.FALLBACK)] == [
        (SPEED, 0.4, 0.0),
        (PATH, 3, 7),
    ]


def test_hold_keeps_the_value_and_its_time(cell: Cell) -> None:
    write(cell, PLC, PART, 3, 1.0)
    cell.release(Requester(PLC), PART, 1.5)
    assert (cell.image.values[PART], cell.image.times[PART]) == (3, 1.0)


def test_releasing_what_is_free_does_nothing_and_what_another_holds_is_refused(cell: Cell) -> None:
    assert cell.release(Requester(HMI), LAMP, 1.0) is None
    write(cell, HMI, LAMP, True, 1.0)
    assert cell.release(Requester(PLC), LAMP, 1.0) == Refusal(Reason.HELD, LAMP, HMI)
    assert cell.release(Requester(HMI), START, 1.0) == Refusal(Reason.NOT_WRITABLE, START)
    assert cell.release(Requester(None), LAMP, 1.0) == Refusal(Reason.NOT_WRITABLE, LAMP)


def test_a_release_without_a_robot_falls_back_once_when_it_is_back(cell: Cell) -> None:
    write(cell, PLC, FORCE, 99.0, 1.0)
    cell.robot_lost("unplugged", 1.1)
    cell.release(Requester(PLC), FORCE, 1.2)
    assert cell.image.values[FORCE] == 99.0
    cell.robot_connected(2.0)
    cell.adopt({FORCE: 99.0}, 2.0)
    assert cell.image.values[FORCE] == 10.0
    write(cell, PLC, FORCE, 50.0, 2.5)
    cell.adopt({START: False}, 2.6)
    assert cell.image.values[FORCE] == 50.0
    assert len(told(cell, EventKind.FALLBACK)) == 1


def test_a_due_fallback_comes_even_if_the_lock_was_taken_meanwhile(cell: Cell) -> None:
    write(cell, PLC, FORCE, 99.0, 1.0)
    cell.robot_lost("unplugged", 1.1)
    cell.release(Requester(PLC), FORCE, 1.2)
    cell.request(Requester(HMI), FORCE, 1.3)
    cell.robot_connected(2.0)
    cell.adopt({FORCE: 99.0}, 2.0)
    assert cell.image.values[FORCE] == 10.0
    assert owner(cell, 3) == HMI


def test_a_due_fallback_comes_even_if_the_controller_does_not_tell_the_input(cell: Cell) -> None:
    write(cell, PLC, FORCE, 99.0, 1.0)
    cell.robot_lost("unplugged", 1.1)
    cell.release(Requester(PLC), FORCE, 1.2)
    cell.robot_connected(2.0)
    cell.adopt({}, 2.0)
    assert (cell.image.values[FORCE], cell.image.quality[FORCE]) == (10.0, Quality.GOOD)


def test_a_fallback_waits_for_a_register_that_is_gone(cell: Cell) -> None:
    write(cell, PLC, FORCE, 99.0, 1.0)
    cell.set_availability([FORCE], False, "claimed", 1.1)
    cell.release(Requester(PLC), FORCE, 1.2)
    cell.adopt({}, 1.3)
    assert cell.image.values[FORCE] == 99.0
    cell.set_availability([FORCE], True, "freed", 2.0)
    cell.adopt({FORCE: 42.0}, 2.0)
    assert cell.image.values[FORCE] == 10.0


def test_a_due_fallback_does_not_undo_a_later_write(cell: Cell) -> None:
    write(cell, PLC, FORCE, 99.0, 1.0)
    cell.set_availability([FORCE], False, "claimed", 1.1)
    cell.release(Requester(PLC), FORCE, 1.2)
    cell.set_availability([FORCE], True, "freed", 2.0)
    assert write(cell, HMI, FORCE, 33.0, 2.1) is None
    cell.adopt({START: False}, 2.2)
    assert cell.image.values[FORCE] == 33.0


def test_clear_on_connect_spares_what_is_owned(press: CellDefinition) -> None:
    cell = Cell(replace(press, clear_on_connect=True))
    cell.request(Requester(PLC), FORCE, 0.5)
    cell.robot_connected(0.5)
    cell.adopt({START: True, PART: 5, FORCE: 33.0}, 0.5)
    assert cell.image.values[START : PATH + 1] == [False, False, 5, 33.0, 0.0, 7]


def test_adopting_takes_over_what_the_controller_holds(press: CellDefinition) -> None:
    cell = Cell(press)
    accepts = [cell.accepts_writes]
    cell.robot_connected(1.0)
    accepts.append(cell.accepts_writes)
    cell.adopt({START: True, FORCE: 200.0}, 1.0)
    assert [*accepts, cell.accepts_writes] == [False, False, True]
    assert cell.image.values[START] is True
    assert cell.image.values[FORCE] == 200.0
    assert cell.image.quality[START : PATH + 1] == [
        Quality.GOOD, Quality.NEVER, Quality.NEVER, Quality.GOOD, Quality.NEVER, Quality.NEVER,
    ]  # fmt: skip


# -- writers -----------------------------------------------------------------------------------------------------


def test_the_last_of_two_connections_releases(cell: Cell) -> None:
    cell.writer_connected(Requester(HMI), 1.0)
    cell.writer_connected(Requester(HMI), 1.0)
    write(cell, HMI, LAMP, True, 1.0)
    cell.writer_disconnected(Requester(HMI), 1.1, "reset")
    assert owner(cell, 1) == HMI
    cell.writer_disconnected(Requester(HMI), 1.2, "reset")
    assert owner(cell, 1) is None
    assert cell.image.values[LAMP] is False
    assert len(told(cell, EventKind.WRITER_LOST)) == 1


def test_a_silent_writer_loses_its_locks_once_and_may_come_back(cell: Cell) -> None:
    cell.writer_connected(Requester(AUX), 1.0)
    write(cell, AUX, FORCE, 50.0, 1.0)
    cell.tick(2.0)
    assert owner(cell, 3) == AUX
    cell.tick(2.01)
    assert owner(cell, 3) is None
    cell.writer_seen(Requester(AUX), 2.5)
    assert cell.writers.alive[AUX]
    write(cell, AUX, FORCE, 60.0, 2.5)
    cell.writer_disconnected(Requester(AUX), 2.6, "closed")
    assert owner(cell, 3) is None
    assert len(told(cell, EventKind.WRITER_LOST)) == 2


def via(writer: int, connection: int, waited: float = 0.0) -> Requester:
    return Requester(writer, connection=connection, waited=waited)


def test_a_lock_follows_the_connection_that_works_with_it(cell: Cell) -> None:
    """A viewer on the same address keeps nothing alive that the program has left."""
    program, viewer = via(HMI, 7), via(HMI, 8)
    cell.writer_connected(program, 1.0)
    cell.writer_connected(viewer, 1.0)
    assert cell.write(program, [Change(LAMP, True), Change(FORCE, 50.0)], 1.0) is None
    assert (cell.holds(7), cell.holds(8), cell.holds(0)) == (True, False, False)
    assert cell.request(viewer, FORCE, 1.1) is None
    cell.writer_disconnected(program, 1.2, "closed by the peer")
    assert (owner(cell, 1), owner(cell, 3)) == (None, HMI)
    assert cell.image.values[LAMP] is False
    assert not cell.holds(7)
    (event,) = told(cell, EventKind.RELEASED)
    assert event.detail == "its connection ended: closed by the peer"
    assert cell.writers.alive[HMI]
    assert told(cell, EventKind.WRITER_LOST) == []
    cell.writer_disconnected(viewer, 1.3, "closed by the peer")
    assert owner(cell, 3) is None
    assert not cell.writers.alive[HMI]


def test_a_refused_write_moves_no_lock_to_its_connection(cell: Cell) -> None:
    """But one that only the robot's absence refuses does: it renews."""
    cell.writer_connected(via(HMI, 7), 1.0)
    cell.writer_connected(via(HMI, 8), 1.0)
    assert cell.write(via(HMI, 7), [Change(PART, 1)], 1.0) is None
    assert cell.write(via(HMI, 8), [Change(PART, 2**40)], 1.1) is not None
    assert (cell.holds(7), cell.holds(8)) == (True, False)
    cell.robot_lost("cable", 1.2)
    assert cell.write(via(HMI, 8), [Change(PART, 2)], 1.3) == Refusal(Reason.ROBOT_LOST, PART)
    assert (cell.holds(7), cell.holds(8)) == (False, True)


def test_a_connection_does_not_end_what_a_higher_writer_or_the_operator_took_from_it(cell: Cell) -> None:
    for connection in (7, 8):
        cell.writer_connected(via(HMI, connection), 1.0)
    assert cell.write(via(HMI, 7), [Change(LAMP, True), Change(PART, 1)], 1.0) is None
    assert cell.write(via(PLC, 9), [Change(LAMP, True)], 1.1) is None
    cell.operator.take_lock(2, 1.1)
    cell.writer_disconnected(via(HMI, 7), 1.2, "closed")
    assert (owner(cell, 1), owner(cell, 2)) == (PLC, OPERATOR)
    assert cell.image.values[LAMP] is True


@pytest.fixture
def patient(press: CellDefinition, connect: Connect) -> Cell:
    """The HMI opens a connection for each write, and has two seconds of grace."""
    cell = Cell(replace(press, writers=(press.writers[PLC], Writer("hmi", grace=2.0), press.writers[AUX])))
    connect(cell, 0.0)
    return cell


def connected_write(cell: Cell, connection: int, variable: int, value: Value, now: float) -> None:
    requester = via(HMI, connection)
    cell.writer_connected(requester, now)
    assert cell.write(requester, [Change(variable, value)], now) is None
    cell.writer_disconnected(requester, now, "closed by the peer")


def test_a_connection_per_write_keeps_its_value_within_the_grace(patient: Cell) -> None:
    seen: list[Value] = []
    patient.listeners.append(lambda _direction: seen.append(patient.image.values[FORCE]))
    for step in range(5):
        connected_write(patient, 10 + step, FORCE, 42.0, 1.0 + 1.9 * step)
        patient.tick(1.0 + 1.9 * step + 1.8)
    assert set(seen) == {42.0}
    assert patient.writers.alive[HMI]
    patient.tick(1.0 + 4 * 1.9 + 2.0)
    assert owner(patient, 3) is None
    assert patient.image.values[FORCE] == 10.0
    (lost,) = told(patient, EventKind.WRITER_LOST)
    assert lost.detail == "connection gone for 2 s"


def test_what_no_connection_goes_on_with_is_released_when_the_grace_has_passed(patient: Cell) -> None:
    connected_write(patient, 10, FORCE, 42.0, 1.0)
    connected_write(patient, 11, LAMP, True, 1.5)
    cell = patient
    cell.writer_connected(via(HMI, 12), 2.0)
    assert cell.request(via(HMI, 12), LAMP, 2.0) is None
    assert cell.write(via(PLC, 1), [Change(PART, 1)], 3.0) is None
    assert (owner(cell, 1), owner(cell, 3)) == (HMI, None), "by any request, not only by the tick"
    (released,) = told(cell, EventKind.RELEASED)
    assert (released.lock, released.detail) == (3, "connection gone for 2 s")
    cell.tick(9.0)
    assert cell.writers.alive[HMI]
    assert owner(cell, 1) is None, "its lease"


def test_a_lease_ends_within_the_grace_and_somebody_else_may_take_over(patient: Cell) -> None:
    connected_write(patient, 10, LAMP, True, 1.0)
    connected_write(patient, 11, PART, 1, 1.0)
    assert patient.write(via(PLC, 1), [Change(LAMP, True)], 1.1) is None
    patient.tick(3.0)
    patient.tick(4.0)
    assert (owner(patient, 1), owner(patient, 2)) == (PLC, None)
    assert patient.image.values[LAMP] is True


def test_a_writer_that_is_known_to_be_gone_has_no_grace(patient: Cell) -> None:
    for connection in (7, 8):
        patient.writer_connected(via(HMI, connection), 1.0)
    assert patient.write(via(HMI, 7), [Change(LAMP, True)], 1.0) is None
    patient.writer_disconnected(via(HMI, 7), 1.1, "its heartbeat stays away", at_once=True)
    assert owner(patient, 1) is None
    patient.writer_disconnected(via(HMI, 8), 1.1, "bus lost", at_once=True)
    assert not patient.writers.alive[HMI]


def test_reads_do_not_feed_a_time_out_that_counts_writes(press: CellDefinition, connect: Connect) -> None:
    """Nor do they, or a connection, make a dead program look alive again."""
    cell = Cell(
        replace(press, writers=(*press.writers[:AUX], Writer("aux", timeout=1.0, counts_writes=True)))
    )
    connect(cell, 0.0)
    cell.writer_connected(via(AUX, 7), 1.0)
    assert not cell.writers.alive[AUX]
    assert cell.write(via(AUX, 7), [Change(FORCE, 50.0)], 1.0) is None
    assert cell.request(via(AUX, 7), FORCE, 1.5) is None
    assert cell.write(via(AUX, 7), [Change(START, True)], 2.0) is not None, (
        "a refused write is a sign of life too"
    )
    cell.writer_connected(via(AUX, 8), 2.5)
    cell.writer_seen(via(AUX, 8), 2.9)
    cell.tick(3.0)
    assert cell.writers.alive[AUX]
    cell.tick(3.01)
    assert not cell.writers.alive[AUX]
    assert owner(cell, 3) is None
    (lost,) = told(cell, EventKind.WRITER_LOST)
    assert lost.detail == "no write for 1 s"
    cell.writer_seen(via(AUX, 8), 3.1)
    cell.writer_connected(via(AUX, 9), 3.1)
    assert not cell.writers.alive[AUX]
    assert cell.write(via(AUX, 7), [Change(FORCE, 50.0)], 3.2) is None
    assert cell.writers.alive[AUX]


# -- after the gateway stood still -------------------------------------------------------------------------------


def test_after_a_gap_what_ended_is_released_and_nobody_is_accused(cell: Cell) -> None:
    write(cell, AUX, FORCE, 50.0, 1.0)
    write(cell, PLC, PART, 5, 1.0)
    assert cell.operator.force(CYCLES, 9, 1.0, 3.0) is None
    cell.gap(1.5, 5.0)
    assert owner(cell, 2) is None, "its lease has ended"
    assert owner(cell, 3) == AUX
    assert not cell.forcing.forces
    assert cell.writers.alive[AUX]
    cell.tick(6.0)
    assert cell.writers.alive[AUX]
    cell.tick(6.01)
    assert not cell.writers.alive[AUX], "one further silent time-out"


def test_short_gaps_keep_no_dead_writer_alive(cell: Cell) -> None:
    write(cell, AUX, FORCE, 50.0, 1.0)
    now = 1.0
    while cell.writers.alive[AUX] and now < 100.0:
        cell.gap(now, now + 0.25)
        now += 0.5
        cell.tick(now)
    assert now < 4.0, "only the time that the gateway stood still is not counted"


def test_a_gap_prolongs_the_grace(patient: Cell) -> None:
    cell = patient
    connected_write(cell, 10, START + 1, True, 1.0)
    cell.writer_connected(via(HMI, 11), 1.0)
    connected_write(cell, 12, FORCE, 42.0, 1.0)
    cell.writer_disconnected(via(HMI, 11), 1.0, "closed")
    cell.gap(1.5, 4.5)
    assert (owner(cell, 1), owner(cell, 3)) == (HMI, HMI)
    cell.tick(5.9)
    assert cell.writers.alive[HMI]
    cell.tick(6.5)
    assert not cell.writers.alive[HMI]
    assert cell.ownership.owners == [None] * 5


def test_what_waited_for_too_long_is_refused_and_is_no_sign_of_life(cell: Cell) -> None:
    late = via(AUX, 7, waited=4.0)
    assert cell.write(late, [Change(FORCE, 50.0)], 5.0) == Refusal(Reason.WAITED, FORCE)
    assert cell.request(late, FORCE, 5.0) == Refusal(Reason.WAITED, FORCE)
    cell.writer_seen(late, 5.0)
    assert owner(cell, 3) is None
    assert not cell.writers.alive[AUX]
    assert cell.image.values[FORCE] == 0.0
    assert cell.health.writes_refused == 2
    assert cell.write(via(AUX, 7, waited=0.9), [Change(FORCE, 50.0)], 5.0) is None


def test_what_waited_renews_nothing_and_a_release_is_always_processed(cell: Cell) -> None:
    assert cell.write(via(HMI, 7), [Change(FORCE, 50.0), Change(LAMP, True)], 1.0) is None
    late = via(HMI, 7, waited=5.5)
    assert cell.write(late, [Change(FORCE, 60.0)], 5.9) == Refusal(Reason.WAITED, FORCE)
    assert cell.ownership.remaining(3, 5.9) == pytest.approx(0.1)
    assert cell.release(late, FORCE, 5.9) is None
    assert owner(cell, 3) is None
    cell.release_all(late, 5.9)
    assert owner(cell, 1) is None


def test_a_dropped_command_releases_what_it_would_have_renewed(cell: Cell) -> None:
    assert cell.write(via(HMI, 7), [Change(LAMP, True), Change(PART, 3), Change(FORCE, 50.0)], 1.0) is None
    assert write(cell, PLC, START, True, 1.0) is None
    cell.drop_waited(via(HMI, 7, waited=4.0), [START, LAMP, LAMP, FORCE, CYCLES], 2.0)
    assert cell.ownership.owners[:4] == [PLC, None, HMI, None]
    assert cell.image.values[START : FORCE + 1] == [True, False, 3, 10.0]
    assert {event.detail for event in told(cell, EventKind.RELEASED)} == {
        "its command waited while the gateway stood still"
    }


@pytest.mark.parametrize("act", ["write", "request"])
def test_whoever_acts_is_supervised_even_if_no_link_announced_him(cell: Cell, act: str) -> None:
    if act == "write":
        write(cell, AUX, FORCE, 50.0, 1.0)
    else:
        cell.request(Requester(AUX), FORCE, 1.0)
    cell.tick(2.5)
    assert owner(cell, 3) is None


def test_release_all_leaves_the_locks_of_others(cell: Cell) -> None:
    write(cell, PLC, START, True, 1.0)
    write(cell, PLC, PART, 2, 1.0)
    write(cell, HMI, LAMP, True, 1.0)
    cell.release_all(Requester(PLC), 1.1)
    assert cell.ownership.owners == [None, HMI, None, None, None]
    assert cell.image.values[START] is False


# -- freshness ---------------------------------------------------------------------------------------------------


def silence(cell: Cell) -> None:
    cell.tick(0.2)


def freeze(cell: Cell) -> None:
    cell.package_arrived(0.0, 0.15)
    cell.tick(0.2)


def lose(cell: Cell) -> None:
    cell.robot_lost("unplugged", 0.2)


@pytest.mark.parametrize("end", [silence, freeze, lose])
def test_dead_outputs_are_not_good_and_show_their_policies(cell: Cell, end: Callable[[Cell], None]) -> None:
    assert cell.image.values[CYCLES:] == [5, 2.5, 3, True]
    assert cell.image.quality[CYCLES:] == [Quality.GOOD] * 4
    end(cell)
    assert cell.image.values[CYCLES:] == [0, 2.5, 99, True]
    assert cell.image.quality[CYCLES:] == [Quality.STALE] * 4
    assert cell.unreadable == {ALARM}


def test_outputs_are_good_only_when_their_values_were_copied(cell: Cell) -> None:
    cell.tick(0.2)
    assert cell.package_arrived(0.3, 0.3)
    assert quality(cell, CYCLES) is Quality.STALE
    cell.outputs_written(0.3)
    assert quality(cell, CYCLES) is Quality.GOOD
    assert cell.unreadable == frozenset()


def late_by(cell: Cell, lag: float, now: float) -> bool:
    """A package that comes `lag` seconds late."""
    shown = cell.package_arrived(now - lag, now, raw=now)
    if shown:
        cell.outputs_written(now)
    return shown


def test_a_late_package_is_as_old_as_it_is_late(cell: Cell) -> None:
    assert late_by(cell, 0.06, 0.1)
    assert cell.image.age(CYCLES, 0.1) == pytest.approx(0.06, abs=0.001)
    assert cell.health.lag == pytest.approx(0.06, abs=0.001)
    cell.tick(0.12)
    assert quality(cell, CYCLES) is Quality.GOOD
    cell.tick(0.145)
    assert cell.freshness.state is Source.LATE
    assert quality(cell, CYCLES) is Quality.STALE


def test_a_package_that_comes_too_late_is_not_shown(cell: Cell) -> None:
    assert not late_by(cell, 0.2, 0.25)
    assert cell.freshness.state is Source.LATE
    assert cell.image.values[CYCLES:] == [0, 2.5, 99, True]
    assert cell.image.quality[CYCLES:] == [Quality.STALE] * 4
    assert cell.unreadable == {ALARM}
    assert [event.detail for event in told(cell, EventKind.STALE)] == ["late"]
    assert cell.accepts_writes


def test_a_lag_at_the_limit_does_not_go_to_and_fro(cell: Cell) -> None:
    states = []
    for now, lag in ((0.2, 0.11), (0.21, 0.09), (0.22, 0.11), (0.23, 0.06), (0.24, 0.04), (0.25, 0.09)):
        late_by(cell, lag, now)
        states.append(cell.freshness.state)
    late, fresh = Source.LATE, Source.FRESH
    assert states == [late, late, late, late, fresh, fresh]
    assert len(told(cell, EventKind.STALE)) == 1


@pytest.mark.parametrize("timestamp", [math.nan, math.inf, -math.inf])
def test_a_timestamp_that_is_no_number_never_moves_on(cell: Cell, timestamp: float) -> None:
    for now in (0.05, 0.1, 0.15):
        assert not cell.package_arrived(timestamp, now)
        cell.tick(now)
    assert cell.freshness.state is Source.FROZEN
    assert late_by(cell, 0.0, 0.2)


def pause(cell: Cell, now: float, seconds: float) -> float:
    """A controller whose clock stood still for 5 s sends again for some time; until when."""
    for _ in range(round(seconds / 0.01)):
        now += 0.01
        assert not late_by(cell, 5.0, now)
    return now


def test_a_controller_that_paused_is_fresh_when_it_answers_quickly(cell: Cell) -> None:
    now = pause(cell, 5.0, 1.2)
    assert cell.lag_doubtful(now)
    assert not cell.lag_doubtful(now + 0.9)
    assert cell.backlog_probed(0.01, now)
    assert cell.health.lag == 0.0
    assert quality(cell, CYCLES) is Quality.STALE
    assert not cell.backlog_probed(0.0, now)
    assert late_by(cell, 5.0, now + 0.01)
    assert not cell.lag_doubtful(now + 9.0)


def test_a_backlog_stays_late_however_long_it_lasts(cell: Cell) -> None:
    now = pause(cell, 5.0, 1.2)
    for _ in range(20):
        assert cell.lag_doubtful(now)
        assert not cell.backlog_probed(4.9, now)
        now = pause(cell, now, 1.05)
    assert cell.freshness.state is Source.LATE


def test_nothing_is_doubtful_of_what_comes_in_time(cell: Cell) -> None:
    now = 0.0
    for _ in range(300):
        now += 0.01
        assert late_by(cell, 0.0, now)
        assert not cell.lag_doubtful(now)
    assert not cell.backlog_probed(0.0, now)


def test_a_new_session_does_not_hide_a_lag(cell: Cell) -> None:
    late_by(cell, 0.5, 1.0)
    cell.robot_connected(1.1)
    assert cell.health.lag == 0.0
    assert not late_by(cell, 0.5, 1.2)
    assert cell.freshness.state is Source.LATE


def test_after_a_gap_nothing_from_before_is_good_and_the_first_quick_package_is(cell: Cell) -> None:
    cell.gap(0.0, 5.0)
    assert cell.freshness.state is Source.SILENT
    assert quality(cell, CYCLES) is Quality.STALE
    assert late_by(cell, 0.0, 5.01)
    assert quality(cell, CYCLES) is Quality.GOOD
    assert cell.image.age(CYCLES, 5.01) == pytest.approx(0.0, abs=0.003)


def test_packages_that_waited_through_a_gap_are_as_old_as_they_are(cell: Cell) -> None:
    cell.gap(0.0, 5.0)
    for sent in (0.01, 0.5, 2.0, 4.0, 4.8):
        assert not cell.package_arrived(sent, 5.0, raw=5.0)
        assert cell.freshness.state is Source.LATE
        assert quality(cell, CYCLES) is Quality.STALE
    assert cell.package_arrived(4.99, 5.0, raw=5.0)


def test_outputs_of_a_program_are_good_while_it_runs(press: CellDefinition, connect: Connect) -> None:
    variables = [replace(one, valid_running=one.direction is Direction.OUTPUT) for one in press.variables]
    cell = Cell(replace(press, variables=tuple(variables)))
    connect(cell, 0.0)
    seen = []
    for number, state in enumerate((None, 0, 1, 2, 3, 4, 5, 6, 99, 2), 1):
        now = number / 100
        assert cell.package_arrived(now, now)
        cell.program(state)
        cell.image.values[CYCLES:] = [number, 2.5, 3, True]
        cell.outputs_written(now)
        assert cell.health.program == state
        good = quality(cell, CYCLES) is Quality.GOOD
        assert (cell.image.values[CYCLES] == number) is good
        assert (cell.unreadable == {ALARM}) is not good
        seen.append(good)
    assert seen == [False, False, False, True, True, True, True, False, False, True]
    cell.operator.force(CYCLES, 77, 0.2, math.inf)
    assert cell.package_arrived(0.21, 0.21)
    cell.program(1)
    cell.outputs_written(0.21)
    assert (cell.image.values[CYCLES], quality(cell, CYCLES)) == (77, Quality.FORCED)
    cell.operator.unforce(CYCLES, 0.22)
    assert (cell.image.values[CYCLES], quality(cell, CYCLES)) == (0, Quality.NOT_RUNNING)
    cell.robot_lost("gone", 0.3)
    assert cell.health.program is None


def test_a_value_that_a_place_cannot_show_is_not_good_and_forced_if_forced(
    press: CellDefinition, connect: Connect
) -> None:
    narrow = [
        replace(one, shown=(0.0, 9.0)) if one.number - 1 in (PART, CYCLES) else one for one in press.variables
    ]
    cell = Cell(replace(press, variables=tuple(narrow)))
    connect(cell, 0.0)
    assert write(cell, PLC, PART, 10, 1.0) is None
    assert (cell.image.values[PART], quality(cell, PART)) == (10, Quality.OUT_OF_RANGE)
    assert cell.operator.force(PART, 11, 1.0, 2.0) is None
    assert quality(cell, PART) is Quality.FORCED
    cell.tick(2.0)
    assert quality(cell, PART) is Quality.OUT_OF_RANGE
    cell.robot_lost("gone", 3.0)
    assert quality(cell, PART) is Quality.STALE


def test_a_package_after_the_session_tells_nothing(cell: Cell) -> None:
    cell.robot_lost("unplugged", 1.0)
    packages = cell.health.packages
    assert not cell.package_arrived(1.1, 1.1)
    cell.outputs_written(1.1)
    assert cell.health.packages == packages
    assert cell.image.output_time == 0.0
    assert len(told(cell, EventKind.FRESH)) == 1


def test_adopting_after_the_session_opens_nothing(cell: Cell) -> None:
    cell.robot_lost("unplugged", 1.0)
    cell.adopt({START: True}, 1.1)
    assert not cell.accepts_writes
    assert cell.image.values[START] is False


def test_a_new_session_ends_the_former_one(cell: Cell) -> None:
    cell.robot_connected(1.0)
    assert not cell.accepts_writes
    assert cell.image.quality == [Quality.STALE] * 10
    assert cell.freshness.state is Source.WAITING


def test_a_controller_that_is_still_frozen_does_not_pass_for_fresh_by_a_new_session(cell: Cell) -> None:
    freeze(cell)
    cell.robot_lost("reset", 0.3)
    cell.robot_connected(0.4)
    assert not cell.package_arrived(0.0, 0.5)
    assert cell.freshness.state is Source.FROZEN
    assert cell.package_arrived(0.6, 0.6)


def test_a_lost_robot_makes_inputs_stale_and_refuses_writes(cell: Cell) -> None:
    cell.robot_lost("unplugged", 1.0)
    assert cell.image.quality[START:CYCLES] == [Quality.STALE] * 6
    assert write(cell, PLC, START, True, 1.0) == Refusal(Reason.ROBOT_LOST, START)


def test_losing_the_robot_twice_is_one_event(cell: Cell) -> None:
    cell.robot_lost("unplugged", 1.0)
    cell.robot_lost("unplugged", 1.1)
    assert len(told(cell, EventKind.ROBOT_LOST)) == 1


def test_a_register_that_comes_is_not_good_before_it_is_told(cell: Cell) -> None:
    both = [START, MODE]
    cell.set_availability(both, False, "claimed", 0.05)
    assert [cell.image.quality[index] for index in both] == [Quality.UNAVAILABLE] * 2
    assert cell.image.values[MODE] == 99
    cell.set_availability(both, True, "freed", 0.06)
    assert [cell.image.quality[index] for index in both] == [Quality.STALE, Quality.NEVER]
    cell.adopt({START: True}, 0.07)
    assert cell.package_arrived(0.07, 0.07)
    cell.outputs_written(0.07)
    assert [cell.image.quality[index] for index in both] == [Quality.GOOD] * 2


def test_availability_before_the_first_session_is_remembered(press: CellDefinition, connect: Connect) -> None:
    cell = Cell(press)
    cell.set_availability([PART, ALARM], False, "no such field", 0.0)
    connect(cell, 0.1)
    assert not cell.image.available[PART]
    assert quality(cell, PART) is Quality.UNAVAILABLE
    assert cell.unreadable == {ALARM}
    cell.robot_lost("unplugged", 0.2)
    assert quality(cell, PART) is Quality.UNAVAILABLE


def test_saying_the_same_availability_again_is_no_event(cell: Cell) -> None:
    count = cell.events.count
    cell.set_availability([START], True, "freed", 1.0)
    assert cell.events.count == count


# -- time --------------------------------------------------------------------------------------------------------


def test_the_heartbeat_counts_ten_times_a_second_and_only_in_tick(cell: Cell) -> None:
    write(cell, PLC, START, True, 0.0)
    assert cell.health.heartbeat == 0
    for step in range(51):
        cell.tick(100 + step * 0.02)
    assert cell.health.started == 100
    assert cell.health.heartbeat == pytest.approx(1 / HEARTBEAT_PERIOD, abs=1)


def test_a_stalled_process_shows_as_missing_beats(cell: Cell) -> None:
    cell.tick(0.0)
    cell.tick(60.0)
    cell.tick(60.01)
    assert cell.health.heartbeat <= 3


# -- refusals told -----------------------------------------------------------------------------------------------


def test_every_refusal_is_counted_and_the_last_one_shown(cell: Cell) -> None:
    for step in range(100):
        write(cell, HMI, START, True, 1 + step * 0.01)
    assert cell.health.writes_refused == 100
    assert cell.last_refusal is not None
    assert cell.last_refusal.time == 1.99
    (event,) = told(cell, EventKind.REFUSED)
    assert (event.writer, event.variable, event.lock, event.reason) == (HMI, START, 0, Reason.NOT_WRITABLE)
    assert (event.old, event.new) == (False, True)


def test_counted_refusals_are_told_by_the_tick(cell: Cell) -> None:
    for _ in range(5):
        write(cell, HMI, START, True, 1.0)
    cell.tick(10.99)
    assert len(told(cell, EventKind.REFUSED)) == 1
    cell.tick(11.0)
    assert [event.repeats for event in told(cell, EventKind.REFUSED)] == [0, 3]


def test_a_refusal_of_a_link_is_recorded_too(cell: Cell) -> None:
    cell.refuse(Requester(None), Refusal(Reason.PARTIAL_VALUE, SPEED), 1.0, 3)
    (event,) = told(cell, EventKind.REFUSED)
    assert (event.writer, event.variable, event.new) == (None, SPEED, 3)
    cell.refuse(Requester(PLC), Refusal(Reason.NO_SUCH_ADDRESS), 1.0)
    assert cell.health.writes_refused == 2
