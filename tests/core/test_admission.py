from __future__ import annotations

import copy
import math
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gatewayd.core.admission import Admission, Change, Verdict
from gatewayd.core.definition import OPERATOR, CellDefinition, Value
from gatewayd.core.image import ProcessImage
from gatewayd.core.ownership import Act, LockTable, Move
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester

PLC, HMI, AUX = range(3)
START, LAMP, PART, FORCE, SPEED, PATH = range(6)
MOTION = 4


class Desk:
    """A judge with the table and the image it looks at."""

    def __init__(self, press: CellDefinition) -> None:
        self.image = ProcessImage(press.variables)
        self.ownership = LockTable(press.locks)
        self.admission = Admission(press.variables, press.writers, self.ownership, self.image)

    def judge(
        self, writer: int | None, *changes: Change, adopted: bool = True, heard: bool = True
    ) -> Verdict:
        before = copy.deepcopy((self.image.values, self.image.quality, self.ownership.owners))
        verdict = self.admission.judge(Requester(writer, trusted=heard), changes, adopted=adopted)
        assert before == (self.image.values, self.image.quality, self.ownership.owners)
        return verdict


@pytest.fixture
def desk(press: CellDefinition) -> Desk:
    return Desk(press)


def test_members_of_a_group_make_one_move(desk: Desk) -> None:
    verdict = desk.judge(HMI, Change(SPEED, 0.5), Change(PATH, 3))
    assert verdict == Verdict(None, [(SPEED, 0.5), (PATH, 3)], {MOTION: Move.ACQUIRE})


def test_values_are_clamped_in_the_verdict(desk: Desk) -> None:
    assert desk.judge(PLC, Change(FORCE, 200.0)).values == [(FORCE, 150.0)]


def test_the_gravest_reason_is_told_of_its_first_variable(desk: Desk) -> None:
    desk.ownership.apply(2, PLC, Move.ACQUIRE, 0.0)
    desk.image.set_available(FORCE, available=False)
    held, gone = Change(PART, 1), Change(FORCE, 1.0)
    wild, foreign = Change(SPEED, 2.0), Change(START, True)
    assert desk.judge(HMI, held).refusal == Refusal(Reason.HELD, PART, PLC)
    assert desk.judge(HMI, held, gone).refusal == Refusal(Reason.CLAIMED_ELSEWHERE, FORCE)
    assert desk.judge(HMI, held, gone, adopted=False).refusal == Refusal(Reason.ROBOT_LOST, PART)
    assert desk.judge(HMI, held, gone, wild).refusal == Refusal(Reason.OUT_OF_LIMITS, SPEED)
    assert desk.judge(HMI, held, gone, wild, foreign).refusal == Refusal(Reason.NOT_WRITABLE, START)


def test_an_undeclared_peer_is_refused_whatever_it_writes(desk: Desk) -> None:
    verdict = desk.judge(None, Change(LAMP, False, implied=True), Change(SPEED, 2.0))
    assert verdict == Verdict(Refusal(Reason.NOT_WRITABLE, LAMP))


def test_without_a_robot_only_own_locks_are_renewed(desk: Desk) -> None:
    desk.ownership.apply(MOTION, AUX, Move.ACQUIRE, 0.0)
    verdict = desk.judge(AUX, Change(SPEED, 0.5), Change(FORCE, 1.0), adopted=False)
    assert verdict == Verdict(Refusal(Reason.ROBOT_LOST, SPEED), [], {MOTION: Move.RENEW})


@pytest.mark.parametrize("value, accepted", [(False, True), (True, False)])
def test_an_implied_bit_of_a_higher_owner_passes_only_unchanged(
    desk: Desk, value: bool, accepted: bool
) -> None:
    desk.ownership.apply(1, PLC, Move.ACQUIRE, 0.0)
    verdict = desk.judge(HMI, Change(LAMP, value, implied=True))
    assert verdict == Verdict(None if accepted else Refusal(Reason.HELD, LAMP, PLC))


@pytest.mark.parametrize("former", [HMI, None])
@pytest.mark.parametrize("value, refusal", [(False, None), (True, Refusal(Reason.NOT_MEANT, LAMP))])
def test_an_implied_bit_that_others_may_own_too_is_neither_taken_over_nor_acquired(
    desk: Desk, former: int | None, value: bool, refusal: Refusal | None
) -> None:
    """The word may have been read before it was released, or before its owner changed it."""
    if former is not None:
        desk.ownership.apply(1, former, Move.ACQUIRE, 0.0)
    assert desk.judge(PLC, Change(LAMP, value, implied=True)) == Verdict(refusal)


@pytest.mark.parametrize("value", [False, True])
def test_an_implied_bit_is_acquired_by_its_only_possible_owner_and_renewed_by_its_owner(
    desk: Desk, value: bool
) -> None:
    implied = Change(START, value, implied=True)
    assert desk.judge(PLC, implied) == Verdict(None, [(START, value)], {0: Move.ACQUIRE})
    desk.ownership.apply(1, HMI, Move.ACQUIRE, 0.0)
    implied = Change(LAMP, value, implied=True)
    assert desk.judge(HMI, implied) == Verdict(None, [(LAMP, value)], {1: Move.RENEW})


def test_what_the_operator_holds_is_no_implied_bit_of_its_only_owner(desk: Desk) -> None:
    desk.ownership.hold(0, math.inf)
    assert desk.judge(PLC, Change(START, False, implied=True)) == Verdict()
    assert desk.judge(PLC, Change(START, True, implied=True)).refusal == Refusal(Reason.HELD, START, OPERATOR)


def test_not_meant_is_told_after_everything_that_stands_in_the_way(desk: Desk) -> None:
    lamp, part = Change(LAMP, True, implied=True), Change(PART, 1)
    assert desk.judge(PLC, lamp, adopted=False).refusal == Refusal(Reason.ROBOT_LOST, LAMP)
    desk.ownership.apply(2, HMI, Move.ACQUIRE, 0.0)
    assert desk.judge(PLC, lamp, part).refusal == Refusal(Reason.HELD, PART, HMI)
    desk.image.set_available(LAMP, available=False)
    assert desk.judge(PLC, lamp, part).refusal == Refusal(Reason.CLAIMED_ELSEWHERE, LAMP)


def whole(press: CellDefinition) -> Desk:
    locks = (*press.locks[:MOTION], replace(press.locks[MOTION], whole=True))
    return Desk(replace(press, locks=locks))


def test_a_group_that_is_taken_over_whole_or_not_at_all(press: CellDefinition) -> None:
    desk = whole(press)
    speed, path = Change(SPEED, 0.5), Change(PATH, 3)
    assert desk.judge(HMI, speed).moves == {MOTION: Move.ACQUIRE}, "a free lock is taken by any part"
    desk.ownership.apply(MOTION, HMI, Move.ACQUIRE, 0.0)
    assert desk.judge(HMI, speed).refusal is None, "its owner writes what it wants to"
    assert desk.judge(PLC, path, path).refusal == Refusal(Reason.PARTIAL_TAKEOVER, PATH)
    assert desk.judge(PLC, Change(FORCE, 1.0), path).refusal == Refusal(Reason.PARTIAL_TAKEOVER, PATH)
    assert desk.judge(PLC, path, speed).moves == {MOTION: Move.TAKE_OVER}
    assert desk.judge(AUX, speed).refusal == Refusal(Reason.HELD, SPEED, HMI)
    assert desk.admission.judge_lock(Requester(PLC), SPEED, Act.REQUEST) is Move.TAKE_OVER


def test_the_operator_may_force_a_part_of_such_a_group(press: CellDefinition) -> None:
    desk = whole(press)
    desk.ownership.apply(MOTION, HMI, Move.ACQUIRE, 0.0)
    assert desk.judge(OPERATOR, Change(SPEED, 0.5)).refusal is None


# What waited. PLC has no time-out; AUX has one of 1 s; the lease of `force` is 5 s, of `part` 2 s.


@pytest.mark.parametrize("who", [(PLC, START, 0.5), (PLC, PART, 2.0), (AUX, FORCE, 1.0)])
@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize("owned", [False, True])
def test_a_request_may_wait_as_long_as_its_writer_may_be_silent(
    desk: Desk, who: tuple[int, int, float], late: bool, owned: bool
) -> None:
    writer, variable, limit = who
    if owned:
        desk.ownership.apply(variable, writer, Move.ACQUIRE, 0.0)
    value: Value = variable == START or 1
    requester = Requester(writer, waited=limit + late * 0.01)
    expected = Refusal(Reason.WAITED, variable) if late else None
    assert desk.admission.judge(requester, [Change(variable, value)], adopted=True).refusal == expected
    judged = desk.admission.judge_lock(requester, variable, Act.REQUEST)
    assert (judged if isinstance(judged, Refusal) else None) == expected
    assert not isinstance(desk.admission.judge_lock(requester, variable, Act.RELEASE), Refusal)


def test_the_shortest_of_all_limits_counts(press: CellDefinition) -> None:
    writers = (replace(press.writers[PLC], heartbeat=3.0), *press.writers[1:])
    desk = Desk(replace(press, writers=writers))
    requester = Requester(PLC, waited=2.5)
    assert desk.admission.judge(requester, [Change(FORCE, 1.0)], adopted=True).refusal is None
    both = [Change(FORCE, 1.0), Change(PART, 1)]
    assert desk.admission.judge(requester, both, adopted=True).refusal == Refusal(Reason.WAITED, FORCE)
    late = Requester(PLC, waited=3.5)
    assert desk.admission.judge(late, [Change(FORCE, 1.0)], adopted=True).refusal is not None


def test_what_waited_and_can_never_work_is_refused_for_that(desk: Desk) -> None:
    late = Requester(HMI, waited=9.0)
    assert desk.admission.judge(late, [Change(START, True)], adopted=True).refusal == Refusal(
        Reason.NOT_WRITABLE, START
    )
    assert desk.admission.judge(late, [Change(LAMP, True)], adopted=False).refusal == Refusal(
        Reason.WAITED, LAMP
    )


def test_an_explicit_bit_takes_over_even_unchanged(desk: Desk) -> None:
    desk.ownership.apply(1, HMI, Move.ACQUIRE, 0.0)
    assert desk.judge(PLC, Change(LAMP, False)).moves == {1: Move.TAKE_OVER}


class Thorough(Admission):
    """Judges every request change by change."""

    def _usual(self, *_arguments: object) -> None:
        return None


def _requests() -> st.SearchStrategy[list[Change]]:
    real = st.one_of(st.floats(-10, 300), st.just(math.nan))
    values = {
        START: st.booleans(),
        LAMP: st.booleans(),
        PART: st.integers(-(1 << 33), 1 << 33),
        PATH: st.integers(-9, 9),
    }
    one = st.integers(START, PATH).flatmap(
        lambda index: st.builds(Change, st.just(index), values.get(index, real), st.booleans())
    )
    return st.lists(one, min_size=1, max_size=6)


@given(
    changes=_requests(),
    writer=st.sampled_from((PLC, HMI, AUX)),
    owners=st.lists(st.sampled_from((None, PLC, HMI, AUX)), min_size=5, max_size=5),
    gone=st.sets(st.integers(START, PATH)),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_quick_way_comes_to_the_same_as_the_thorough_one(
    press: CellDefinition,
    changes: list[Change],
    writer: int,
    owners: list[int | None],
    gone: set[int],
) -> None:
    desk, thorough = Desk(press), Desk(press)
    thorough.admission = Thorough(press.variables, press.writers, thorough.ownership, thorough.image)
    for one in (desk, thorough):
        one.ownership.owners[:] = [
            owner if owner in lock.owners else None for owner, lock in zip(owners, press.locks, strict=True)
        ]
        for index in gone:
            one.image.set_available(index, available=False)
    # As texts: NaN equals nothing, itself included.
    assert repr(desk.judge(writer, *changes)) == repr(thorough.judge(writer, *changes))


def test_who_is_not_heard_is_refused_by_his_first_variable_unless_it_can_never_work(desk: Desk) -> None:
    desk.ownership.apply(2, PLC, Move.ACQUIRE, 0.0)
    force, held, wild = Change(FORCE, 1.0), Change(PART, 1), Change(SPEED, 2.0)
    lost = Refusal(Reason.HEARTBEAT_LOST, FORCE)
    assert desk.judge(HMI, force, held, heard=False).refusal == lost
    assert desk.judge(HMI, force, held, heard=False, adopted=False).refusal == lost
    assert desk.judge(HMI, force, wild, heard=False).refusal == Refusal(Reason.OUT_OF_LIMITS, SPEED)
    assert desk.judge(None, force, heard=False).refusal == Refusal(Reason.NOT_WRITABLE, FORCE)
    assert desk.judge(HMI, heard=False).refusal == Refusal(Reason.HEARTBEAT_LOST)


def test_not_even_an_unchanged_implied_bit_passes_from_who_is_not_heard(desk: Desk) -> None:
    desk.ownership.apply(1, PLC, Move.ACQUIRE, 0.0)
    verdict = desk.judge(HMI, Change(LAMP, False, implied=True), heard=False)
    assert verdict.refusal == Refusal(Reason.HEARTBEAT_LOST, LAMP)


def test_who_owns_it_all_has_to_be_heard_as_well(desk: Desk) -> None:
    desk.ownership.apply(2, PLC, Move.ACQUIRE, 0.0)
    assert desk.judge(PLC, Change(PART, 1)).refusal is None
    assert desk.judge(PLC, Change(PART, 1), heard=False).refusal == Refusal(Reason.HEARTBEAT_LOST, PART)
