"""A cell whose definition is replaced while it runs: what goes on, what is released, and that nothing else shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import (
    OPERATOR,
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Limits,
    Lock,
    Value,
    ValueKind,
    Variable,
    Writer,
)
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.match import Match
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import LENGTH
from gatewayd.core.succession import left_behind, losing, succeed

PLC, HMI, AUX = range(3)
START, LAMP, PART, FORCE, SPEED, PATH, CYCLES, LEVEL, MODE, ALARM = range(10)


def without(definition: CellDefinition, *names: str) -> CellDefinition:
    """The definition without some variables; a lock that loses a member goes whole, its others are locked alone."""
    kept = [variable for variable in definition.variables if variable.name not in names]
    locks: list[Lock] = []
    variables: list[Variable] = []
    for index, variable in enumerate(kept):
        lock = definition.locks[variable.lock] if variable.lock is not None else None
        if lock is not None:
            locks.append(Lock(variable.name, (index,), lock.owners, lock.takeover, lock.lease))
        number = len(locks) - 1 if lock is not None else None
        variables.append(replace(variable, number=index + 1, lock=number))
    return replace(definition, variables=tuple(variables), locks=tuple(locks))


def changed(definition: CellDefinition, index: int, **fields: object) -> CellDefinition:
    variables = list(definition.variables)
    variables[index] = replace(variables[index], **fields)  # type: ignore[arg-type]
    return replace(definition, variables=tuple(variables))


def kinds(cell: Cell) -> list[EventKind]:
    return [event.kind for event in cell.events]


def test_values_owner_and_lease_go_on(cell: Cell, press: CellDefinition) -> None:
    assert cell.write(Requester(PLC), [Change(PART, 7), Change(LAMP, value=True)], 1.0) is None
    told: list[Event] = []
    cell.events.listeners.append(told.append)
    new = succeed(cell, changed(press, PART, limits=Limits(0, 5)), 1.5).cell
    assert new.image.values[PART] == 7
    assert new.image.time_of(PART) == 1.0
    assert new.ownership.owners[2] == PLC
    assert new.ownership.remaining(2, 1.5) == 1.5
    assert new.ownership.owners[1] == PLC
    assert new.image.values[CYCLES:] == [5, 2.5, 3, True]
    assert told == []
    refusal = new.write(Requester(PLC), [Change(PART, 6)], 1.6)
    assert refusal is not None
    assert refusal.reason is Reason.OUT_OF_LIMITS
    new.tick(3.1)
    assert new.ownership.owners[2] is None, "the lease ends when it would have ended"


def test_a_removed_input_is_released_and_cleared_once(cell: Cell, press: CellDefinition) -> None:
    """The old cell does it, whose listener is the robot link; what comes after has other numbers."""
    assert cell.write(Requester(HMI), [Change(FORCE, 99.0), Change(SPEED, 0.5)], 1.0) is None
    robot: list[float] = []
    cell.listeners.append(lambda _direction: robot.append(float(cell.image.values[FORCE])))
    succession = succeed(cell, without(press, "force", "path"), 2.0)
    assert robot[-1] == 10.0
    assert succession.stranded == ()
    new = succession.cell
    assert [variable.name for variable in new.definition.variables][:4] == ["start", "lamp", "part", "speed"]
    assert new.ownership.owners == [None] * 4, "the group is not the same without one of its members"
    released = [event for event in new.events if event.kind is EventKind.RELEASED]
    assert [event.writer for event in released] == [HMI, HMI]
    assert "lock force, since removed" in released[0].detail


def test_an_unowned_input_that_nobody_will_write_any_more_is_cleared_too(press: CellDefinition) -> None:
    """Say a command that a former life of the gateway left in the controller: it could never be cleared again."""
    cell = Cell(press)
    cell.robot_connected(0.0)
    cell.adopt(dict.fromkeys(range(6), True), 0.0)
    succeed(cell, without(press, "start"), 1.0)
    assert cell.image.values[START] is False
    assert cell.image.values[LAMP] is True


def test_a_renamed_input_keeps_its_register(press: CellDefinition) -> None:
    cell = Cell(press)
    cell.robot_connected(0.0)
    cell.adopt(dict.fromkeys(range(6), True), 0.0)
    new = succeed(cell, changed(press, START, name="go"), 1.0).cell
    assert cell.image.values[START] is True
    assert new.image.quality[START] is Quality.NEVER, "the link tells what it holds"


def test_what_the_robot_could_not_be_told_is_named(cell: Cell, press: CellDefinition) -> None:
    assert cell.write(Requester(PLC), [Change(START, value=True), Change(PART, 3)], 1.0) is None
    cell.robot_lost("cable", 1.5)
    succession = succeed(cell, without(press, "start", "part", "force"), 2.0)
    assert succession.stranded == ("start", "part"), (
        "nobody could clear either any more; force was never touched"
    )


def test_another_robot_gets_nothing_of_what_the_present_one_holds(cell: Cell, press: CellDefinition) -> None:
    """Its owners lose it, the present robot gets the fallbacks, and the other one is as a robot after a start."""
    assert cell.write(Requester(PLC), [Change(START, value=True), Change(PART, 3)], 1.0) is None
    cell.writers.connected(PLC, 1.0)
    cell.adoption.over = True
    before = cell.health.writes_accepted
    succession = succeed(cell, press, 2.0, same_robot=False)
    assert succession.stranded == ("part",), "its policy is to hold it"
    assert (cell.image.values[START], cell.image.values[PART]) == (False, 3)
    new = succession.cell
    assert new.ownership.owners == [None] * len(press.locks)
    assert set(new.image.quality) == {Quality.NEVER}
    assert (new.image.values[START], new.image.values[PART], new.delivery.owed) == (False, 0, set())
    assert (new.writers.alive[PLC], new.health.writes_accepted, new.adoption.over) == (True, before, False)
    kinds = [event.kind for event in cell.events]
    assert kinds.count(EventKind.RELEASED) == 2


def test_what_would_be_left_is_known_before_and_after(cell: Cell, press: CellDefinition) -> None:
    assert cell.write(Requester(PLC), [Change(START, value=True), Change(PART, 3)], 1.0) is None
    match = Match(press, press, same_robot=False)
    assert list(left_behind(cell, match)) == [PART]
    assert losing(cell, match) == [press.variables[START].lock, press.variables[PART].lock]
    cell.robot_lost("cable", 1.5)
    assert list(left_behind(cell, match)) == [START, PART]
    assert succeed(cell, press, 2.0, same_robot=False).stranded == ("start", "part")


def test_fallbacks_that_fell_due_are_given_after_the_robot_is_back(cell: Cell, press: CellDefinition) -> None:
    assert cell.write(Requester(PLC), [Change(START, value=True)], 1.0) is None
    cell.robot_lost("cable", 1.5)
    cell.release_all(Requester(PLC), 1.6)
    new = succeed(cell, without(press, "lamp"), 2.0).cell
    new.robot_connected(3.0)
    new.adopt({START: True}, 3.0)
    assert new.image.values[START] is False


def test_a_fallback_that_fell_due_is_owed_under_another_name_too(cell: Cell, press: CellDefinition) -> None:
    assert cell.write(Requester(PLC), [Change(START, value=True)], 1.0) is None
    cell.robot_lost("cable", 1.5)
    succession = succeed(cell, changed(press, START, name="go"), 2.0)
    assert succession.stranded == ()
    new = succession.cell
    new.robot_connected(3.0)
    new.adopt({START: True}, 3.0)
    assert new.image.values[START] is False


def test_an_owner_that_may_own_no_longer_is_released_first(cell: Cell, press: CellDefinition) -> None:
    assert cell.write(Requester(HMI), [Change(LAMP, value=True)], 1.0) is None
    locks = list(press.locks)
    locks[1] = replace(locks[1], owners=(PLC,))
    new = succeed(cell, replace(press, locks=tuple(locks)), 2.0).cell
    assert new.ownership.owners[1] is None
    assert new.image.values[LAMP] is False
    assert kinds(new)[-2:] == [EventKind.RELEASED, EventKind.FALLBACK]


def test_writers_are_known_by_name(cell: Cell, press: CellDefinition) -> None:
    """Their order in the file, and with it their numbers, may change."""
    cell.writer_connected(Requester(HMI), 0.5)
    cell.writer_connected(Requester(HMI), 0.6)
    assert cell.write(Requester(HMI), [Change(FORCE, 50.0)], 1.0) is None
    order = (HMI, AUX, PLC)
    locks = tuple(
        replace(lock, owners=tuple(order.index(owner) for owner in lock.owners)) for lock in press.locks
    )
    writers = (Writer("hmi"), Writer("aux", timeout=1.0), Writer("plc"))
    new = succeed(cell, replace(press, locks=locks, writers=writers), 2.0).cell
    assert (new.writers.alive[0], new.writers.connections[0], new.writers.last_seen[0]) == (True, 2, 1.0)
    new.writer_disconnected(Requester(0), 3.0, "gone")
    assert new.ownership.owners == [None, None, None, 0, None]
    new.writer_disconnected(Requester(0), 3.0, "gone")
    assert new.ownership.owners == [None] * 5


def test_connections_and_graces_survive(cell: Cell, press: CellDefinition) -> None:
    writers = (press.writers[PLC], Writer("hmi", grace=2.0), press.writers[AUX])
    definition = replace(press, writers=writers)
    cell = succeed(cell, definition, 0.5).cell
    program, viewer = Requester(HMI, connection=7), Requester(HMI, connection=8)
    for requester in (program, viewer):
        cell.writer_connected(requester, 1.0)
    assert cell.write(program, [Change(FORCE, 50.0)], 1.0) is None
    assert cell.write(viewer, [Change(LAMP, value=True)], 1.0) is None
    cell.writer_disconnected(program, 1.5, "closed")
    new = succeed(cell, without(definition, "start"), 2.0).cell
    assert (new.holds(7), new.holds(8)) == (True, True)
    new.tick(3.5)
    assert new.ownership.owners == [HMI, None, None, None, None]
    new.writer_disconnected(viewer, 3.5, "closed")
    new.tick(5.5)
    assert not new.writers.alive[HMI]
    assert new.ownership.owners == [None] * 5


def test_a_writer_that_is_gone_loses_its_locks(cell: Cell, press: CellDefinition) -> None:
    assert cell.write(Requester(HMI), [Change(FORCE, 50.0)], 1.0) is None
    assert cell.write(Requester(HMI), [Change(START, value=True)], 1.1) is not None
    locks = tuple(
        replace(lock, owners=tuple(owner for owner in lock.owners if owner == PLC)) for lock in press.locks
    )
    new = succeed(cell, replace(press, locks=locks, writers=press.writers[:1]), 2.0).cell
    assert set(new.ownership.owners) == {None}
    assert new.last_refusal is not None
    assert new.last_refusal.writer is None
    assert any("writer hmi, since removed" in event.detail for event in new.events)


@pytest.mark.parametrize("after, left", [(5.0, 4.0), (2.0, 2.0), (None, float("inf"))])
def test_a_lease_of_another_length_begins_anew(
    cell: Cell, press: CellDefinition, after: float | None, left: float
) -> None:
    assert cell.write(Requester(PLC), [Change(FORCE, 1.0)], 1.0) is None
    locks = list(press.locks)
    locks[3] = replace(locks[3], lease=after)
    new = succeed(cell, replace(press, locks=tuple(locks)), 2.0).cell
    assert new.ownership.remaining(3, 2.0) == left


def test_an_output_that_is_stale_shows_its_new_fallback(cell: Cell, press: CellDefinition) -> None:
    cell.tick(1.0)
    assert cell.freshness.state is Source.SILENT
    new = succeed(cell, changed(press, CYCLES, on_stale=Fallback(FallbackKind.VALUE, 42)), 1.0).cell
    assert new.image.values[CYCLES] == 42
    assert new.image.quality[CYCLES] is Quality.STALE
    assert new.unreadable == {ALARM}


def test_an_output_that_is_new_is_good_with_the_next_package(cell: Cell, press: CellDefinition) -> None:
    new_one = Variable(11, "extra", Direction.OUTPUT, ValueKind.INT, "output_int_register_9")
    new = succeed(cell, replace(press, variables=(*press.variables, new_one)), 1.0).cell
    qualities = new.image.quality[10:]
    assert new.package_arrived(1.0, 1.0)
    new.outputs_written(1.0)
    assert [*qualities, *new.image.quality[10:]] == [Quality.NEVER, Quality.GOOD]


def test_the_lag_goes_on(cell: Cell, press: CellDefinition) -> None:
    assert cell.package_arrived(0.04, 0.1, raw=0.1)
    cell.outputs_written(0.1)
    new = succeed(cell, press, 0.1).cell
    assert new.health.lag == pytest.approx(0.06, abs=0.001)
    assert new.image.age(CYCLES, 0.1) == pytest.approx(0.06, abs=0.001)
    assert not new.package_arrived(0.05, 0.3, raw=0.3)
    assert new.freshness.state is Source.LATE


def test_what_cannot_be_shown_any_more_is_not_good_at_once(cell: Cell, press: CellDefinition) -> None:
    new = succeed(cell, changed(press, CYCLES, shown=(0.0, 4.0)), 0.1).cell
    assert (new.image.values[CYCLES], new.image.quality[CYCLES]) == (5, Quality.OUT_OF_RANGE)
    again = succeed(new, press, 0.1).cell
    assert (again.image.values[CYCLES], again.image.quality[CYCLES]) == (5, Quality.GOOD)


def test_what_is_now_valid_while_a_program_runs_is_good_only_if_one_does(
    cell: Cell, press: CellDefinition
) -> None:
    new = succeed(cell, changed(press, ALARM, valid_running=True), 0.1).cell
    assert new.image.quality[ALARM] is Quality.NOT_RUNNING
    assert new.unreadable == {ALARM}
    new.program(2)
    assert new.package_arrived(0.1, 0.1)
    new.outputs_written(0.1)
    assert succeed(new, changed(press, ALARM, valid_running=True), 0.1).cell.unreadable == frozenset()


def test_forces_and_taken_locks_of_the_operator_go_on(cell: Cell, press: CellDefinition) -> None:
    assert cell.operator.force(FORCE, 33.0, 1.0, until=9.0) is None
    assert cell.operator.force(CYCLES, 1234, 1.0, until=9.0) is None
    cell.operator.take_lock(2, 1.0, until=8.0)
    new = succeed(cell, without(press, "lamp"), 2.0).cell
    force, cycles = FORCE - 1, CYCLES - 1
    assert (new.image.values[force], new.image.values[cycles]) == (33.0, 1234)
    assert (new.image.quality[force], new.image.quality[cycles]) == (Quality.FORCED, Quality.FORCED)
    assert new.ownership.held_by(OPERATOR) == [1, 2]
    new.tick(8.5)
    assert new.ownership.held_by(OPERATOR) == [2]
    new.tick(9.5)
    assert new.ownership.held_by(OPERATOR) == []
    assert (new.image.values[force], new.image.values[cycles]) == (10.0, 0), "the robot is silent by now"


def test_the_force_of_what_is_gone_ends(cell: Cell, press: CellDefinition) -> None:
    assert cell.operator.force(FORCE, 33.0, 1.0, until=9.0) is None
    new = succeed(cell, without(press, "force"), 2.0).cell
    assert cell.image.values[FORCE] == 10.0
    assert not new.forcing.forces
    assert EventKind.UNFORCED in kinds(new)


# -- any history ------------------------------------------------------------------------------------------


def _value(cell: Cell, index: int, number: int) -> Value:
    return bool(number) if cell.definition.variables[index].kind is ValueKind.BOOL else number


def _connect(cell: Cell, _who: int, _which: int, _number: int, now: float) -> None:
    cell.robot_connected(now)
    cell.adopt(dict.fromkeys(range(6), 0), now)


def _package(cell: Cell, who: int, which: int, number: int, now: float) -> None:
    lag = 0.07 * (which % 3)
    if cell.package_arrived(now - lag if who else 1.0, now):
        cell.program(2 * number)
        cell.image.values[6:10] = [5, which / 2, 3, True]
        cell.outputs_written(now)


def via(writer: int, number: int) -> Requester:
    """One of two connections of the writer."""
    return Requester(writer, connection=1 + 2 * writer + number % 2)


DEEDS: dict[str, Callable[[Cell, int, int, int, float], object]] = {
    "write": lambda cell, who, which, number, now: cell.write(
        via(who, which + number), [Change(which, _value(cell, which, number))], now
    ),
    "request": lambda cell, who, which, _, now: cell.request(via(who, which), which, now),
    "release": lambda cell, who, which, _, now: cell.release(Requester(who), which, now),
    "connected": lambda cell, who, which, _, now: cell.writer_connected(via(who, which), now),
    "disconnected": lambda cell, who, which, _, now: cell.writer_disconnected(via(who, which), now, "closed"),
    "gap": lambda cell, who, _which, _, now: cell.gap(now - who, now),
    "available": lambda cell, who, which, _, now: cell.set_availability([which], bool(who), "in use", now),
    "force": lambda cell, _who, which, number, now: cell.operator.force(
        which, _value(cell, which, number), now, now + 2.0
    ),
    "take": lambda cell, _who, which, _, now: cell.operator.take_lock(which % 5, now, now + 2.0),
    "connect": _connect,
    "lost": lambda cell, _who, _which, _, now: cell.robot_lost("cable", now),
    "package": _package,
    "tick": lambda cell, _who, _which, _, now: cell.tick(now),
    "succeed": lambda cell, _who, _which, _, now: cell.tick(now),
}
"""What may happen. A succession looks at the clock before it hands over, as every request does."""

INPUTS = st.integers(START, PATH)
EVERY = st.integers(START, ALARM)
WRITERS = st.sampled_from([PLC, HMI, AUX])
STEP = st.tuples(
    st.sampled_from(list(DEEDS)),
    WRITERS,
    INPUTS | EVERY,
    st.integers(0, 1),
    st.sampled_from([0, 0.01, 0.3, 1.1, 6]),
)
HISTORY = st.lists(STEP, max_size=40)
Step = tuple[str, int, int, int, float]


def act(cell: Cell, step: Step, now: float) -> None:
    what, who, which, number, _pause = step
    if what != "write" or which <= PATH:
        DEEDS[what](cell, who, which, number, now)


def observed(cell: Cell, now: float) -> tuple[object, ...]:
    image = cell.image
    ages = [image.time_of(index) for index in range(10)]
    return (
        StatusBlock(cell).read(0, LENGTH, now),
        list(cell.events),
        cell.events.count,
        (image.values, image.quality, image.available, ages, image.unreadable),
        (cell.ownership.owners, cell.ownership.expires, cell.ownership.connections, cell.ownership.orphans),
        (cell.writers.alive, cell.writers.connections, cell.writers.last_seen),
        cell.accepts_writes,
    )


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(history=HISTORY, grace=st.sampled_from([0.0, 0.5]))
def test_a_succession_that_changes_nothing_cannot_be_noticed(
    press: CellDefinition, history: list[Step], grace: float
) -> None:
    """Two cells with one history, of which one is succeeded now and then, are the same to every observer."""
    variables = list(press.variables)
    for index in (LEVEL, ALARM):
        variables[index] = replace(variables[index], valid_running=True)
    for index in (SPEED, LEVEL):
        variables[index] = replace(variables[index], shown=(0.0, 3.0))
    writers = (replace(press.writers[PLC], grace=grace), *press.writers[1:])
    press = replace(press, variables=tuple(variables), writers=writers)
    plain, replaced = Cell(press), Cell(press)
    now = 0.0
    for step in history:
        now += step[-1]
        act(plain, step, now)
        act(replaced, step, now)
        if step[0] == "succeed":
            replaced = succeed(replaced, press, now).cell
        assert observed(replaced, now) == observed(plain, now)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    history=HISTORY,
    names=st.sets(st.sampled_from(["start", "lamp", "part", "force", "speed", "path", "cycles", "alarm"])),
    fewer=st.booleans(),
)
def test_no_owner_and_no_release_is_lost(
    press: CellDefinition,
    history: list[Step],
    names: set[str],
    fewer: bool,
) -> None:
    """Every lock that was owned still is by the same writer, or its release is among the events."""
    cell, now = Cell(press), 0.0
    for step in history:
        now += step[-1]
        act(cell, step, now)
    cell.tick(now)
    definition = without(press, *names)
    if fewer:
        locks = tuple(replace(lock, owners=lock.owners[:1]) for lock in definition.locks)
        definition = replace(definition, locks=locks)
    before = {
        lock.name: (owner, lock.members)
        for lock, owner in zip(press.locks, cell.ownership.owners, strict=True)
        if owner is not None
    }
    count = cell.events.count
    new = succeed(cell, definition, now).cell
    owners = list(zip(definition.locks, new.ownership.owners, strict=True))
    after = {lock.name: owner for lock, owner in owners if owner is not None}
    for lock, owner in owners:
        assert owner in (None, OPERATOR, *lock.owners)
    assert all(before[name][0] == owner for name, owner in after.items())
    fresh = list(new.events)[-(new.events.count - count) :] if new.events.count > count else []
    released = [event.writer for event in fresh if event.kind is EventKind.RELEASED]
    lost = [owner for name, (owner, _) in before.items() if name not in after]
    assert sorted(map(str, released)) == sorted(map(str, lost))
    for name, (_, members) in before.items():
        for index in members if name not in after else ():
            variable = press.variables[index]
            wanted = variable.on_release.apply(cell.image.values[index], variable.kind)
            owed = not (cell.accepts_writes and cell.image.available[index])
            assert owed or cell.image.values[index] == wanted
