"""The table of roles."""

from __future__ import annotations

from gatewayd.links.standby.roles import MOVES, RoleSignal, StandbyRole


def test_every_role_can_be_left_and_reached() -> None:
    assert {role for role, _signal in MOVES} == set(StandbyRole)
    assert set(MOVES.values()) | {StandbyRole.STANDING_BY} == set(StandbyRole)


def test_every_signal_moves_something() -> None:
    assert {signal for _role, signal in MOVES} == set(RoleSignal)


def test_nobody_serves_without_having_claimed() -> None:
    """To a role that serves leads a claim, directly or by the address that follows it."""
    entering = {
        (role, signal) for (role, signal), next_role in MOVES.items() if next_role.serves and not role.serves
    }
    assert entering == {(StandbyRole.TAKING_ADDRESS, RoleSignal.ADDRESS_HELD)}
    into_taking = {signal for (_, signal), role in MOVES.items() if role is StandbyRole.TAKING_ADDRESS}
    assert into_taking == {RoleSignal.CLAIMED}


def test_who_may_have_the_address_has_the_claim_or_had_it_just_now() -> None:
    claiming = {StandbyRole.TAKING_ADDRESS, StandbyRole.ACTIVE, StandbyRole.RECOVERING}
    assert {role for role in StandbyRole if role.has_claim} == claiming
    assert all(role.has_claim for role in StandbyRole if role.serves)


def test_numbers_are_those_of_the_status_block() -> None:
    assert [(role.value, role.words) for role in StandbyRole] == [
        (1, "standing by"),
        (2, "mismatched"),
        (3, "taking address"),
        (4, "active"),
        (5, "recovering"),
        (6, "leaving"),
    ]
