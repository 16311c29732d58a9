"""The local operator: locks taken and released, values forced and given back, and the truth kept underneath."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR, CellDefinition, Value
from gatewayd.core.events import EventKind
from gatewayd.core.forcing import Holder
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.succession import succeed

PLC, HMI, AUX = range(3)
START, LAMP, PART, FORCE, SPEED, PATH, CYCLES, LEVEL, MODE, ALARM = range(10)
MOTION = 4
SECOND = 60.0
ANNA = Holder("anna", "her token")


def kinds(cell: Cell) -> list[EventKind]:
    return [event.kind for event in cell.events]


def package(cell: Cell, now: float, cycles: int, *, alarm: bool = False) -> None:
    """As the robot link does it."""
    if cell.package_arrived(now, now):
        cell.image.values[CYCLES] = cycles
        cell.image.values[ALARM] = alarm
        cell.outputs_written(now)


class TestLocks:
    def test_the_operator_takes_a_lock_from_any_owner_and_keeps_it(self, cell: Cell) -> None:
        """No priority of the mapping outranks him, and no lease of it ends his. `part` holds its value."""
        assert cell.write(Requester(PLC), [Change(PART, 7)], 1.0) is None
        cell.operator.take_lock(PART, 1.1, detail="by anna")
        refusal = cell.write(Requester(PLC), [Change(PART, 8)], 100.0)
        assert refusal is not None
        assert (refusal.reason, refusal.holder) == (Reason.HELD, OPERATOR)
        assert cell.image.values[PART] == 7
        taken = next(event for event in cell.events if event.kind is EventKind.TAKEN_OVER)
        assert (taken.writer, taken.other, taken.detail) == (OPERATOR, PLC, "by anna")

    def test_what_he_takes_from_a_writer_falls_back_at_once(self, cell: Cell) -> None:
        """As with any takeover by request: its command would go on as nobody's."""
        assert cell.write(Requester(HMI), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0) is None
        seen: list[list[Value]] = []
        cell.listeners.append(lambda _direction: seen.append(cell.image.values[SPEED : PATH + 1]))
        cell.operator.take_lock(MOTION, 1.5)
        assert seen == [[0.0, 7]]
        assert kinds(cell)[-3:] == [EventKind.TAKEN_OVER, EventKind.FALLBACK, EventKind.FALLBACK]

    def test_what_was_given_or_he_has_already_stays_as_it_is(self, cell: Cell) -> None:
        cell.operator.take_lock(MOTION, 1.0)
        assert cell.operator.force(PATH, 3, 1.5, SECOND) is None
        cell.operator.take_lock(MOTION, 2.0)
        assert cell.operator.force(SPEED, 0.5, 3.0, SECOND) is None
        assert cell.image.values[SPEED : PATH + 1] == [0.5, 3]

    def test_of_a_free_group_he_inherits_nothing_that_was_only_adopted(self, cell: Cell) -> None:
        cell.adopt({SPEED: 0.4, PATH: 3}, 0.5)
        cell.operator.take_lock(MOTION, 1.0)
        assert cell.image.values[SPEED : PATH + 1] == [0.0, 7]

    def test_not_even_the_first_of_a_takeover_list_gets_it_back(self, cell: Cell) -> None:
        cell.operator.take_lock(MOTION, 1.0)
        assert cell.request(Requester(PLC), SPEED, 1.1) is not None
        assert cell.ownership.owners[MOTION] == OPERATOR

    def test_a_taken_lock_is_free_after_its_time_limit(self, cell: Cell) -> None:
        cell.operator.take_lock(LAMP, 1.0, until=2.0)
        assert cell.ownership.remaining(LAMP, 1.5) == 0.5
        cell.tick(2.0)
        assert cell.ownership.owners[LAMP] is None
        assert cell.write(Requester(HMI), [Change(LAMP, True)], 2.0) is None

    def test_taking_again_changes_the_time_limit(self, cell: Cell) -> None:
        cell.operator.take_lock(LAMP, 1.0, until=2.0)
        cell.operator.take_lock(LAMP, 1.5)
        cell.tick(1000.0)
        assert cell.ownership.owners[LAMP] == OPERATOR
        assert kinds(cell).count(EventKind.ACQUIRED) == 1

    def test_he_releases_any_lock_and_its_fallback_applies(self, cell: Cell) -> None:
        assert cell.write(Requester(HMI), [Change(FORCE, 99.0)], 1.0) is None
        assert cell.operator.free_lock(FORCE, 1.5, "by anna")
        assert cell.ownership.owners[FORCE] is None
        assert cell.image.values[FORCE] == 10.0
        released = next(event for event in cell.events if event.kind is EventKind.RELEASED)
        assert (released.writer, released.detail) == (HMI, "released by the local operator (by anna)")

    def test_releasing_a_free_lock_does_nothing(self, cell: Cell) -> None:
        before = cell.events.count
        assert not cell.operator.free_lock(FORCE, 1.0)
        assert cell.events.count == before

    def test_the_status_block_shows_him_as_255(self, cell: Cell) -> None:
        cell.operator.take_lock(PART, 1.0)
        assert StatusBlock(cell).read(192 + PART, 1, 1.0) == b"\x00\xff"

    def test_the_end_of_the_gateway_releases_his_locks_too(self, cell: Cell) -> None:
        cell.operator.take_lock(PART, 1.0)
        assert cell.operator.force(CYCLES, 9, 1.0, SECOND) is None
        assert cell.write(Requester(HMI), [Change(LAMP, True)], 1.0) is None
        cell.stop(2.0, "the gateway stops")
        assert cell.ownership.owners == [None] * 5
        assert (cell.image.values[LAMP], cell.image.values[CYCLES]) == (False, 5)

    def test_who_takes_it_next_is_an_event_of_its_own(self, cell: Cell) -> None:
        """Nothing changes hands on the bus, but who answers for it does."""
        cell.operator.take_lock(PART, 1.0, detail="by token anna", holder=ANNA)
        cell.operator.take_lock(PART, 1.1, 5.0, detail="by token anna", holder=ANNA)
        taken = [event.detail for event in cell.events if event.writer == OPERATOR]
        assert taken == ["by token anna"]
        cell.operator.take_lock(PART, 1.2, detail="by bert", holder=Holder("bert"))
        last = list(cell.events)[-1]
        assert (last.kind, last.writer, last.other) == (EventKind.TAKEN_OVER, OPERATOR, OPERATOR)
        assert last.detail == "by bert, held by token anna before"
        assert cell.forcing.holders(PART, ()) == [Holder("bert")]


class TestHolders:
    """What one holds ends with what he acts by, and what another one needs does not."""

    def test_a_lock_that_another_one_forces_in_stays_the_operators(self, cell: Cell) -> None:
        cell.operator.take_lock(MOTION, 1.0, holder=ANNA)
        assert cell.operator.force(SPEED, 0.4, 1.0, 50.0) is None
        assert cell.operator.end_of(lambda holder: holder == ANNA, 2.0, "revoked")
        assert (cell.ownership.owners[MOTION], cell.ownership.expires[MOTION]) == (OPERATOR, 50.0)
        assert list(cell.forcing.forces) == [SPEED]

    def test_forces_end_and_the_lock_that_another_one_took_stays(self, cell: Cell) -> None:
        cell.operator.take_lock(MOTION, 1.0)
        assert cell.operator.force(SPEED, 0.4, 1.0, 50.0, holder=ANNA) is None
        assert cell.operator.force(CYCLES, 9, 1.0, 50.0, holder=ANNA) is None
        assert cell.operator.end_of(lambda holder: holder == ANNA, 2.0, "revoked")
        assert (cell.ownership.owners[MOTION], cell.ownership.expires[MOTION]) == (OPERATOR, math.inf)
        assert cell.forcing.forces == {}
        assert [event.detail for event in cell.events if event.kind is EventKind.UNFORCED] == ["revoked"] * 2

    def test_fallbacks_apply_as_with_a_release(self, cell: Cell) -> None:
        assert cell.operator.force(SPEED, 0.4, 1.0, 50.0, holder=ANNA) is None
        assert cell.operator.end_of(lambda holder: holder == ANNA, 2.0, "revoked")
        assert cell.image.values[SPEED] == 0.0
        assert cell.ownership.owners[MOTION] is None

    def test_nothing_of_his_is_nothing_to_do(self, cell: Cell) -> None:
        cell.operator.take_lock(MOTION, 1.0)
        before = len(cell.events)
        assert not cell.operator.end_of(lambda holder: holder == ANNA, 2.0, "revoked")
        assert len(cell.events) == before

    def test_they_outlive_a_reload(self, cell: Cell, press: CellDefinition) -> None:
        cell.operator.take_lock(MOTION, 1.0, holder=ANNA)
        successor = succeed(cell, press, 1.5).cell
        assert successor.operator.end_of(lambda holder: holder == ANNA, 2.0, "revoked")
        assert successor.ownership.owners[MOTION] is None


class TestForcedInput:
    def test_the_robot_gets_it_and_the_plc_is_refused(self, cell: Cell) -> None:
        assert cell.operator.force(FORCE, 42.0, 1.0, 31.0) is None
        assert (cell.image.values[FORCE], cell.image.quality[FORCE]) == (42.0, Quality.FORCED)
        refusal = cell.write(Requester(PLC), [Change(FORCE, 1.0)], 2.0)
        assert refusal is not None
        assert refusal.reason is Reason.HELD
        assert cell.image.values[FORCE] == 42.0

    def test_the_other_members_of_a_writers_group_fall_back(self, cell: Cell) -> None:
        assert cell.write(Requester(HMI), [Change(SPEED, 0.4), Change(PATH, 3)], 1.0) is None
        seen: list[list[Value]] = []
        cell.listeners.append(lambda _direction: seen.append(cell.image.values[SPEED : PATH + 1]))
        assert cell.operator.force(PATH, 5, 1.5, SECOND) is None
        assert seen[0] == [0.0, 5], "in one package"

    @pytest.mark.parametrize("by_time", [True, False])
    def test_afterwards_the_policy_rules_and_the_plc_may_write(self, cell: Cell, by_time: bool) -> None:
        assert cell.operator.force(FORCE, 42.0, 1.0, 31.0) is None
        if by_time:
            cell.tick(31.0)
        else:
            assert cell.operator.unforce(FORCE, 30.0)
        assert (cell.image.values[FORCE], cell.image.quality[FORCE]) == (10.0, Quality.GOOD)
        assert cell.ownership.owners[FORCE] is None
        assert cell.write(Requester(PLC), [Change(FORCE, 1.0)], 31.0) is None
        assert kinds(cell).count(EventKind.UNFORCED) == 1

    @pytest.mark.parametrize(
        "variable, value, reason",
        [
            (SPEED, 2.0, Reason.OUT_OF_LIMITS),
            (PART, 2**31, Reason.OUT_OF_LIMITS),
            (PART, 1.5, Reason.OUT_OF_LIMITS),
        ],
    )
    def test_limits_hold_for_him_too(self, cell: Cell, variable: int, value: Value, reason: Reason) -> None:
        refusal = cell.operator.force(variable, value, 1.0, SECOND)
        assert refusal is not None
        assert refusal.reason is reason
        assert OPERATOR not in cell.ownership.owners

    def test_without_a_robot_it_is_refused(self, press: CellDefinition) -> None:
        refusal = Cell(press).operator.force(START, True, 1.0, SECOND)
        assert refusal is not None
        assert refusal.reason is Reason.ROBOT_LOST

    def test_it_says_stale_while_the_robot_is_away_and_is_sent_when_it_comes_back(
        self, cell: Cell, connect: Callable[[Cell, float], None]
    ) -> None:
        assert cell.operator.force(FORCE, 42.0, 1.0, SECOND) is None
        cell.robot_lost("gone", 2.0)
        assert cell.image.quality[FORCE] is Quality.STALE
        connect(cell, 3.0)
        assert (cell.image.values[FORCE], cell.image.quality[FORCE]) == (42.0, Quality.FORCED)
        assert cell.image.times[FORCE] == 3.0

    def test_a_group_is_held_until_its_last_force_ends(self, cell: Cell) -> None:
        assert cell.operator.force(SPEED, 0.5, 1.0, 10.0) is None
        assert cell.operator.force(PATH, 3, 1.0, 20.0) is None
        cell.tick(10.0)
        assert (cell.image.values[SPEED], cell.image.values[PATH]) == (0.0, 3)
        assert cell.ownership.owners[MOTION] == OPERATOR
        cell.tick(20.0)
        assert (cell.image.values[PATH], cell.ownership.owners[MOTION]) == (7, None)

    def test_a_lock_taken_before_stays_taken_after(self, cell: Cell) -> None:
        cell.operator.take_lock(FORCE, 1.0)
        assert cell.operator.force(FORCE, 42.0, 1.0, 10.0) is None
        cell.tick(10.0)
        assert cell.ownership.owners[FORCE] == OPERATOR
        assert cell.image.values[FORCE] == 10.0

    def test_releasing_the_lock_ends_the_force(self, cell: Cell) -> None:
        assert cell.operator.force(FORCE, 42.0, 1.0, SECOND) is None
        assert cell.operator.free_lock(FORCE, 2.0)
        assert (cell.image.quality[FORCE], cell.image.values[FORCE]) == (Quality.GOOD, 10.0)
        assert not cell.forcing.forces

    def test_forcing_again_changes_value_and_end(self, cell: Cell) -> None:
        assert cell.operator.force(FORCE, 42.0, 1.0, 5.0) is None
        assert cell.operator.force(FORCE, 43.0, 2.0, 9.0) is None
        cell.tick(5.0)
        assert cell.image.values[FORCE] == 43.0
        cell.tick(9.0)
        assert cell.image.values[FORCE] == 10.0


class TestForcedOutput:
    def test_the_fieldbus_sees_it_through_every_package(self, cell: Cell) -> None:
        assert cell.operator.force(CYCLES, 99, 1.0, SECOND) is None
        package(cell, 1.1, 6)
        assert (cell.image.values[CYCLES], cell.image.quality[CYCLES]) == (99, Quality.FORCED)
        assert cell.image.age(CYCLES, 4.0) == 3.0

    def test_afterwards_the_truth_is_back_at_once(self, cell: Cell) -> None:
        """Also a bit that the robot link copies only when its word changes."""
        seen: list[Value] = []
        assert cell.operator.force(ALARM, False, 1.0, SECOND) is None
        package(cell, 1.1, 6, alarm=True)
        cell.listeners.append(lambda _direction: seen.append(cell.image.values[ALARM]))
        assert cell.package_arrived(1.2, 1.2)
        cell.outputs_written(1.2)
        assert seen == [False]
        assert cell.operator.unforce(ALARM, 1.3)
        assert (cell.image.values[ALARM], cell.image.quality[ALARM]) == (True, Quality.GOOD)
        assert seen[-1] is True

    def test_it_needs_no_robot_and_never_looks_fresh(self, press: CellDefinition) -> None:
        cell = Cell(press)
        assert cell.operator.force(CYCLES, 99, 1.0, 2.0) is None
        assert (cell.image.values[CYCLES], cell.image.quality[CYCLES]) == (99, Quality.FORCED)
        assert StatusBlock(cell).read(3264 + CYCLES, 1, 1.0) == b"\x00\x04"
        assert StatusBlock(cell).read(64, 1, 1.0) == b"\x00\x00"
        cell.tick(2.0)
        assert (cell.image.values[CYCLES], cell.image.quality[CYCLES]) == (0, Quality.NEVER)

    def test_a_robot_lost_meanwhile_leaves_the_fallback_afterwards(self, cell: Cell) -> None:
        assert cell.operator.force(MODE, 1, 1.0, SECOND) is None
        cell.robot_lost("gone", 2.0)
        assert (cell.image.values[MODE], cell.image.quality[MODE]) == (1, Quality.FORCED)
        assert cell.operator.unforce(MODE, 3.0)
        assert (cell.image.values[MODE], cell.image.quality[MODE]) == (99, Quality.STALE)

    def test_an_exception_output_can_be_read_while_it_is_forced(self, press: CellDefinition) -> None:
        cell = Cell(press)
        assert cell.unreadable == {ALARM}
        assert cell.operator.force(ALARM, True, 1.0, SECOND) is None
        assert cell.unreadable == frozenset()
        assert cell.operator.unforce(ALARM, 2.0)
        assert cell.unreadable == {ALARM}

    def test_what_is_not_forced_cannot_be_unforced(self, cell: Cell) -> None:
        assert not cell.operator.unforce(CYCLES, 1.0)


# The definition that the fixture gives is immutable.
any_order = settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)

# Whatever happens meanwhile: when the last force has ended, a cell is what it would be without any.

OUTPUTS = st.sampled_from([CYCLES, LEVEL, MODE, ALARM])
STEPS = st.one_of(
    st.tuples(st.just("package"), st.integers(0, 3), st.booleans()),
    st.tuples(st.just("frozen"), st.none(), st.none()),
    st.tuples(st.just("lost"), st.none(), st.none()),
    st.tuples(st.just("connected"), st.none(), st.none()),
    st.tuples(st.just("gone"), OUTPUTS, st.booleans()),
    st.tuples(st.just("tick"), st.none(), st.none()),
    st.tuples(st.just("force"), OUTPUTS, st.sampled_from([0.05, 0.3, 9.0])),
    st.tuples(st.just("unforce"), OUTPUTS, st.none()),
)


ALIKE: dict[str, Callable[[Cell, float, int, float], object]] = {
    "package": lambda cell, now, cycles, alarm: package(cell, now, cycles, alarm=bool(alarm)),
    "frozen": lambda cell, _now, _first, _second: package(cell, 0.0, 9),
    "lost": lambda cell, now, _first, _second: cell.robot_lost("gone", now),
    "connected": lambda cell, now, _first, _second: cell.robot_connected(now),
    "gone": lambda cell, now, index, gone: cell.set_availability([index], not gone, "", now),
    "tick": lambda cell, now, _first, _second: cell.tick(now),
}
"""What befalls the cell with forces and the one without."""


@any_order
@given(st.lists(STEPS, max_size=30))
def test_forced_outputs_leave_no_trace(press: CellDefinition, steps: list[tuple[str, int, float]]) -> None:
    forced, plain = Cell(press), Cell(press)
    now = 1.0
    for what, first, second in steps:
        now += 0.0625
        if what in ALIKE:
            ALIKE[what](forced, now, first, second)
            ALIKE[what](plain, now, first, second)
        elif what == "force":
            value: Value = True if first == ALARM else 77.5 if first == LEVEL else 77
            assert forced.operator.force(first, value, now, now + second) is None
        else:
            forced.operator.unforce(first, now)
        for index in forced.image.outputs:
            force = forced.forcing.forces.get(index)
            truth = plain.image.values[index], plain.image.quality[index]
            shown = forced.image.values[index], forced.image.quality[index]
            assert shown == (truth if force is None else (force.value, Quality.FORCED))
    for cell in (forced, plain):
        cell.tick(now + 100.0)
    assert forced.image.values == plain.image.values
    assert forced.image.quality == plain.image.quality
    assert forced.unreadable == plain.unreadable
    assert [forced.image.time_of(i) for i in range(10)] == [plain.image.time_of(i) for i in range(10)]


ACTS = st.one_of(
    st.tuples(st.just("force"), st.integers(0, 5), st.sampled_from([0.2, 1.0])),
    st.tuples(st.just("unforce"), st.integers(0, 5), st.none()),
    st.tuples(st.just("take"), st.integers(0, 4), st.sampled_from([0.3, math.inf])),
    st.tuples(st.just("free"), st.integers(0, 4), st.none()),
    st.tuples(st.just("write"), st.integers(0, 5), st.integers(0, 2)),
    st.tuples(st.just("lost"), st.none(), st.none()),
    st.tuples(st.just("connect"), st.none(), st.none()),
    st.tuples(st.just("tick"), st.none(), st.none()),
)


def zero(cell: Cell, index: int) -> Value:
    return cell.definition.variables[index].kind.zero


OPERATING: dict[str, Callable[[Cell, float, int, float], object]] = {
    "force": lambda cell, now, index, limit: cell.operator.force(index, zero(cell, index), now, now + limit),
    "unforce": lambda cell, now, index, _: cell.operator.unforce(index, now),
    "take": lambda cell, now, lock, limit: cell.operator.take_lock(lock, now, now + limit),
    "free": lambda cell, now, lock, _: cell.operator.free_lock(lock, now),
    "write": lambda cell, now, index, writer: cell.write(
        Requester(int(writer)), [Change(index, zero(cell, index))], now
    ),
    "lost": lambda cell, now, _first, _second: cell.robot_lost("gone", now),
    "tick": lambda cell, now, _first, _second: cell.tick(now),
}


@any_order
@given(st.lists(ACTS, max_size=30))
def test_the_operator_owns_exactly_what_he_took_or_forces(
    press: CellDefinition, connect: Callable[[Cell, float], None], acts: list[tuple[str, int, float]]
) -> None:
    cell = Cell(press)
    now = 1.0
    connect(cell, now)
    for what, first, second in acts:
        now += 0.125
        if what == "connect":
            connect(cell, now)
        else:
            OPERATING[what](cell, now, first, second)
        forcing = cell.forcing
        for lock, owner in enumerate(cell.ownership.owners):
            members = press.locks[lock].members
            held = lock in forcing.holds or any(member in forcing.forces for member in members)
            assert (owner == OPERATOR) == held
            assert owner != OPERATOR or cell.ownership.expires[lock] == forcing.until(lock, members)
        for index in range(10):
            assert cell.image.quality[index] is not (
                Quality.GOOD if index in forcing.forces else Quality.FORCED
            )
