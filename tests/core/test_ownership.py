from __future__ import annotations

import itertools
import math

import pytest

from gatewayd.core.definition import Lock
from gatewayd.core.ownership import MOVES, Act, LockTable, Move, Standing

RANKED, LISTED, ENDLESS = range(3)


@pytest.fixture
def table() -> LockTable:
    return LockTable(
        [
            Lock("ranked", (0,), (2, 0, 1), takeover=True, lease=1.0),
            Lock("listed", (1,), (0, 1), lease=1.0),
            Lock("endless", (2,), (0, 1)),
        ]
    )


def test_every_standing_and_act_has_a_move() -> None:
    assert MOVES.keys() == set(itertools.product(Standing, Act))


def test_a_move_keeps_the_promises_of_ownership() -> None:
    for (standing, act), move in MOVES.items():
        assert (move is Move.REFUSE_NEVER) == (standing is Standing.EXCLUDED)
        assert (move is Move.TAKE_OVER) == (standing is Standing.HIGHER and act is not Act.RELEASE)
        assert (move is Move.RELEASE) == (standing is Standing.OWNER and act is Act.RELEASE)
        if standing is Standing.LOWER:
            assert move is Move.REFUSE_HELD


def test_writing_and_requesting_are_one_to_the_lock() -> None:
    for standing in Standing:
        assert MOVES[standing, Act.WRITE] is MOVES[standing, Act.REQUEST]


def test_rank_is_the_place_in_the_list_not_the_number_of_the_writer(table: LockTable) -> None:
    table.apply(RANKED, 0, Move.ACQUIRE, 0.0)
    standings = [table.standing(RANKED, writer) for writer in range(4)]
    assert standings == [Standing.OWNER, Standing.LOWER, Standing.HIGHER, Standing.EXCLUDED]


def test_without_takeover_nobody_ranks_above_the_owner(table: LockTable) -> None:
    table.apply(LISTED, 1, Move.ACQUIRE, 0.0)
    assert table.standing(LISTED, 0) is Standing.LOWER


def test_deciding_changes_nothing(table: LockTable) -> None:
    for lock, writer, act in itertools.product(range(3), range(4), Act):
        table.decide(lock, writer, act)
    assert table.owners == [None, None, None]


@pytest.mark.parametrize("move", [Move.NOTHING, Move.REFUSE_HELD, Move.REFUSE_NEVER])
def test_applying_a_refusal_changes_nothing(table: LockTable, move: Move) -> None:
    table.apply(LISTED, 1, Move.ACQUIRE, 0.0)
    table.apply(LISTED, 0, move, 0.5)
    assert (table.owners[LISTED], table.expires[LISTED]) == (1, 1.0)


def test_a_lease_ends_at_its_time_and_not_before(table: LockTable) -> None:
    table.apply(LISTED, 0, Move.ACQUIRE, 5.0)
    assert table.expired(math.nextafter(6.0, 0)) == []
    assert table.remaining(LISTED, 6.0) == 0.0
    assert table.expired(6.0) == [LISTED]


def test_an_earlier_and_a_renewed_lease_are_both_noticed(table: LockTable) -> None:
    table.apply(LISTED, 0, Move.ACQUIRE, 5.0)
    table.apply(RANKED, 0, Move.ACQUIRE, 5.5)
    table.apply(LISTED, 0, Move.RENEW, 5.9)
    assert table.expired(6.2) == []
    assert table.expired(6.5) == [RANKED]
    table.free(RANKED)
    assert table.expired(6.9) == [LISTED]


def test_what_expired_is_told_again_until_it_is_freed(table: LockTable) -> None:
    table.apply(LISTED, 0, Move.ACQUIRE, 5.0)
    assert table.expired(7.0) == table.expired(7.0) == [LISTED]


def test_a_takeover_starts_a_lease_of_its_own(table: LockTable) -> None:
    table.apply(RANKED, 1, Move.ACQUIRE, 5.0)
    table.apply(RANKED, 2, Move.TAKE_OVER, 5.75)
    assert (table.owners[RANKED], table.remaining(RANKED, 6.0)) == (2, 0.75)


def test_without_a_lease_a_lock_is_owned_without_end(table: LockTable) -> None:
    assert table.remaining(ENDLESS, 0.0) == 0.0
    table.apply(ENDLESS, 1, Move.ACQUIRE, 0.0)
    assert table.remaining(ENDLESS, 1e9) == math.inf
    assert table.expired(1e9) == []


def test_freeing_names_the_former_owner_once(table: LockTable) -> None:
    table.apply(LISTED, 1, Move.ACQUIRE, 0.0)
    table.apply(ENDLESS, 1, Move.ACQUIRE, 0.0)
    assert table.held_by(1) == [LISTED, ENDLESS]
    assert table.free(LISTED) == 1
    assert table.free(LISTED) is None
    assert table.held_by(1) == [ENDLESS]


def test_a_lock_follows_one_connection_of_its_owner_until_it_is_free_or_the_operators(
    table: LockTable,
) -> None:
    for lock in (LISTED, ENDLESS):
        table.apply(lock, 1, Move.ACQUIRE, 5.0)
        table.follow(lock, 7)
    assert table.held_through(1, 7) == [LISTED, ENDLESS]
    assert table.held_through(0, 7) == table.held_through(1, 0) == []
    table.free(LISTED)
    table.hold(ENDLESS, math.inf)
    assert table.connections == [0, 0, 0]


def test_an_orphan_is_one_no_more_when_another_connection_goes_on_with_it(table: LockTable) -> None:
    for lock in range(3):
        table.apply(lock, 1, Move.ACQUIRE, 5.0)
        table.orphans[lock] = 7.0
    table.follow(RANKED, 8)
    table.free(ENDLESS)
    assert table.orphaned(6.99) == []
    assert table.orphaned(7.0) == [LISTED]


def test_owners_leases_connections_and_orphans_go_on_in_a_successor(table: LockTable) -> None:
    for lock in (LISTED, ENDLESS):
        table.apply(lock, 1, Move.ACQUIRE, 5.0)
        table.follow(lock, 7)
    table.orphans[LISTED] = 5.5
    new = LockTable([Lock("endless", (2,), (0, 1), lease=3.0), Lock("listed", (1,), (0, 1), lease=1.0)])
    new.succeed(table, {LISTED: 1, ENDLESS: 0}, {0: 1, 1: 0}, 5.25)
    assert (new.owners, new.expires) == ([0, 0], [8.25, 6.0])
    assert (new.connections, new.orphans) == ([7, 7], {1: 5.5})
    assert new.expired(6.0) == [1]
