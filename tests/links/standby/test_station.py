"""A gateway of two: its roles, when it asks for the claim, and what it does with it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.contract import Claim, Duty
from gatewayd.links.standby.heartbeat import Heartbeat
from gatewayd.links.standby.roles import StandbyRole
from gatewayd.links.standby.sight import GONE_AFTER, PERIOD, Sight
from gatewayd.links.standby.station import (
    ADDRESS_WITHIN,
    FAST,
    FAST_FOR,
    JITTER,
    LEAVE_FOR,
    LOST_FOR,
    READY_AFTER,
    SLOW,
    TAKEN_FOR,
    StandbyStation,
)

LOOK = 0.02
OTHER = Heartbeat(StandbyRole.ACTIVE, connected=True, ready=False, fingerprint=7, number=22, echo=11)
READY = replace(OTHER, role=StandbyRole.STANDING_BY, ready=True)


@dataclass
class Rig:
    """A station, looked at every 20 ms, and the other gateway as long as it says something."""

    other: Heartbeat | None = OTHER
    claim: Claim = Claim.UNASKED
    address: bool | None = False
    has_address: bool = True
    served_last: bool = False
    now: float = 1000.0
    asked: list[float] = field(default_factory=list)
    withdrawn: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.sight = Sight(11, 7)
        self.station = StandbyStation(
            self.sight, lambda: 0.5, has_address=self.has_address, served_last=self.served_last
        )
        self.duty = Duty(serve=False)

    @property
    def role(self) -> StandbyRole:
        return self.station.role

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self.now += LOOK
            if self.other is not None:
                self.sight.heard(self.other, self.now)
            self.station.look(self.claim, self.address, self.now)
            self.duty = self.station.duty(self.now)
            if self.duty.ask:
                self.asked.append(self.now)
            if self.duty.withdraw:
                self.withdrawn.append(self.now)

    def active(self) -> Rig:
        """It serves the cell, and the other one is ready."""
        self.other, self.claim, self.address = READY, Claim.HELD, True
        self.run(2 * LOOK)
        assert self.role is StandbyRole.ACTIVE
        return self

    def pauses(self) -> list[float]:
        return [round(after - before, 3) for before, after in zip(self.asked, self.asked[1:], strict=False)]


def test_the_other_is_heard_before_anything_is_asked() -> None:
    rig = Rig(other=None)
    rig.run(GONE_AFTER)
    assert rig.asked == []
    rig.run(0.1)
    assert rig.asked


def test_while_the_other_serves_it_asks_slowly() -> None:
    rig = Rig(claim=Claim.REFUSED)
    rig.run(5)
    assert min(rig.pauses()) >= SLOW
    assert max(rig.pauses()) <= SLOW * (1 + JITTER) + LOOK
    assert rig.role is StandbyRole.STANDING_BY
    assert rig.duty.why == "this gateway stands by: the other gateway serves the cell"


@pytest.mark.parametrize("other", [None, replace(OTHER, role=StandbyRole.LEAVING)], ids=["gone", "leaving"])
def test_when_the_other_does_not_it_asks_quickly_at_once(other: Heartbeat | None) -> None:
    rig = Rig(claim=Claim.REFUSED)
    rig.run(2)
    rig.other, since = other, rig.now
    rig.asked.clear()
    rig.run(3)
    assert rig.asked[0] - since <= (GONE_AFTER if other is None else 0) + 2 * LOOK
    assert max(rig.pauses()) <= FAST * (1 + JITTER) + LOOK


def test_quick_attempts_become_slow_when_nothing_comes_of_them() -> None:
    rig = Rig(claim=Claim.REFUSED, other=None)
    rig.run(FAST_FOR + 2)
    rig.asked.clear()
    rig.run(5)
    assert min(rig.pauses()) >= SLOW


def test_the_address_follows_the_claim_and_the_cell_is_served_then() -> None:
    rig = Rig(other=None, claim=Claim.HELD)
    rig.run(LOOK)
    assert (rig.role, rig.role.has_claim, rig.duty.serve) == (StandbyRole.TAKING_ADDRESS, True, False)
    rig.address = True
    rig.run(LOOK)
    assert (rig.role, rig.duty, rig.station.takeovers) == (StandbyRole.ACTIVE, Duty(serve=True), 1)


def test_without_a_virtual_address_the_claim_is_enough() -> None:
    rig = Rig(other=None, claim=Claim.HELD, address=None, has_address=False)
    rig.run(LOOK)
    assert rig.role is StandbyRole.ACTIVE


def test_an_address_that_does_not_come_leaves_the_robot_to_the_other() -> None:
    rig = Rig(other=READY, claim=Claim.HELD)
    rig.run(ADDRESS_WITHIN + 2 * LOOK)
    assert (rig.role, bool(rig.withdrawn), rig.station.unaddressed) == (StandbyRole.LEAVING, True, True)
    rig.claim = Claim.UNASKED
    rig.run(LEAVE_FOR - 0.2)
    assert rig.asked == []
    rig.run(0.5)
    assert (rig.role, bool(rig.asked)) == (StandbyRole.STANDING_BY, True)


def test_who_loses_the_address_gives_the_robot_back() -> None:
    rig = Rig().active()
    rig.address = False
    rig.run(LOOK)
    assert (rig.role, rig.duty.serve, rig.duty.withdraw) == (StandbyRole.LEAVING, False, True)


def test_an_address_of_which_nothing_is_known_is_not_lost() -> None:
    rig = Rig().active()
    rig.address = None
    rig.run(1)
    assert rig.role is StandbyRole.ACTIVE


def test_a_robot_that_restarts_finds_its_gateway() -> None:
    """Neither has a session: the one that serves keeps address and connections, and asks as soon as it can."""
    rig = Rig().active()
    rig.claim, rig.other = Claim.NO_SESSION, replace(READY, connected=False, ready=False)
    rig.run(20)
    assert (rig.role, rig.duty.serve, rig.role.has_claim) == (StandbyRole.RECOVERING, True, True)
    rig.claim = Claim.UNASKED
    rig.run(LOOK)
    assert rig.asked == [rig.now]
    rig.claim = Claim.HELD
    rig.run(LOOK)
    assert (rig.role, rig.station.takeovers) == (StandbyRole.ACTIVE, 1)


def test_only_the_other_reaches_the_robot() -> None:
    rig = Rig().active()
    rig.claim = Claim.NO_SESSION
    rig.run(LOST_FOR - 0.1)
    assert rig.role is StandbyRole.RECOVERING
    rig.run(0.2)
    assert (rig.role, rig.role.has_claim, rig.duty.serve) == (StandbyRole.STANDING_BY, False, False)


def test_the_other_was_quicker_after_a_restart_of_the_robot() -> None:
    rig = Rig().active()
    rig.claim = Claim.REFUSED
    rig.other = replace(OTHER, role=StandbyRole.TAKING_ADDRESS)
    rig.run(2 * LOOK)
    assert (rig.role, rig.duty.serve) == (StandbyRole.STANDING_BY, False)


def test_inputs_in_use_and_nobody_seen_may_be_our_own_former_connection() -> None:
    rig = Rig().active()
    rig.claim, rig.other = Claim.REFUSED, None
    rig.run(TAKEN_FOR - 0.1)
    assert rig.duty.serve
    rig.run(0.2)
    assert rig.role is StandbyRole.STANDING_BY


def test_a_part_of_the_inputs_is_given_back() -> None:
    rig = Rig(other=None, claim=Claim.PARTIAL)
    rig.run(LOOK)
    assert rig.withdrawn == [rig.now]
    rig.claim = Claim.UNASKED
    rig.withdrawn.clear()
    rig.run(1)
    assert rig.withdrawn == []
    assert rig.asked


def test_another_mapping_never_takes_over() -> None:
    rig = Rig(other=replace(OTHER, fingerprint=8))
    rig.run(0.1)
    assert rig.role is StandbyRole.MISMATCHED
    rig.other = None
    rig.run(60)
    assert (rig.role, rig.asked) == (StandbyRole.MISMATCHED, [])
    rig.other = OTHER
    rig.run(1)
    assert (rig.role, bool(rig.asked)) == (StandbyRole.STANDING_BY, True)


def test_a_claim_that_comes_with_another_mapping_is_given_back() -> None:
    rig = Rig(other=replace(OTHER, fingerprint=8), claim=Claim.HELD)
    rig.run(2 * LOOK)
    assert (rig.role, bool(rig.withdrawn)) == (StandbyRole.MISMATCHED, True)


def test_the_one_that_serves_goes_on_beside_another_mapping() -> None:
    rig = Rig().active()
    rig.other = replace(READY, fingerprint=8)
    rig.run(5)
    assert rig.role is StandbyRole.ACTIVE


def test_the_one_that_served_last_claims_again_beside_another_mapping() -> None:
    mismatched = replace(OTHER, role=StandbyRole.MISMATCHED, fingerprint=8)
    rig = Rig(other=mismatched, served_last=True)
    rig.run(1)
    assert (rig.role, bool(rig.asked)) == (StandbyRole.STANDING_BY, True)
    rig = Rig(other=mismatched)
    rig.run(1)
    assert (rig.role, rig.asked) == (StandbyRole.MISMATCHED, [])


def test_who_sees_the_other_serve_the_cell_did_not_serve_it_last() -> None:
    rig = Rig(other=replace(OTHER, fingerprint=8), served_last=True)
    rig.run(1)
    assert (rig.role, rig.station.served_last) == (StandbyRole.MISMATCHED, False)
    served = Rig().active()
    assert served.station.served_last


def test_planned_switch() -> None:
    rig = Rig().active()
    assert rig.station.hand_over(rig.now) == ""
    rig.run(LOOK)
    assert (rig.role, rig.duty.serve) == (StandbyRole.LEAVING, False)
    rig.claim, rig.other = Claim.UNASKED, OTHER
    rig.run(LOOK)
    assert rig.role is StandbyRole.STANDING_BY


@pytest.mark.parametrize(
    "other, why",
    [
        (None, "the other gateway is not heard"),
        (replace(READY, fingerprint=8), "the mapping of the other gateway differs"),
        (
            replace(READY, ready=False, connected=False),
            "the other gateway is not ready: it does not reach the robot",
        ),
        (
            replace(READY, ready=False),
            "the other gateway is not ready: it has just started, or did not get the address (see its status)",
        ),
    ],
)
def test_a_switch_to_nobody_is_refused(other: Heartbeat | None, why: str) -> None:
    rig = Rig().active()
    rig.other = other
    rig.run(1)
    assert rig.station.hand_over(rig.now) == why
    rig.run(1)
    assert rig.role is StandbyRole.ACTIVE


def test_a_switch_is_made_where_the_cell_is_served() -> None:
    rig = Rig()
    rig.run(1)
    assert "hand over at the one that serves the cell" in rig.station.hand_over(rig.now)


def test_who_does_not_reach_the_robot_is_not_ready() -> None:
    rig = Rig(claim=Claim.NO_SESSION)
    rig.run(READY_AFTER + LOOK)
    assert not rig.station.ready(rig.now)
    rig.claim = Claim.REFUSED
    rig.run(LOOK)
    assert rig.station.ready(rig.now)


@pytest.mark.parametrize("has_address", [True, False])
def test_who_has_just_started_is_ready_when_keepalived_has_seen_it(has_address: bool) -> None:
    """Its check for a live process looks once a second: before that the address does not come."""
    rig = Rig(claim=Claim.REFUSED, has_address=has_address)
    rig.run(1)
    assert rig.station.ready(rig.now) is not has_address
    rig.run(READY_AFTER)
    assert rig.station.ready(rig.now)


def test_who_did_not_get_the_address_is_not_ready() -> None:
    """A planned switch to it would cost as much again."""
    rig = Rig(other=None, claim=Claim.HELD)
    rig.run(ADDRESS_WITHIN + 2 * LOOK)
    assert rig.station.unaddressed
    rig.other, rig.claim = OTHER, Claim.REFUSED
    rig.run(1)
    assert rig.role is StandbyRole.STANDING_BY
    assert not rig.station.ready(rig.now)


EVENTS = st.tuples(
    st.sampled_from(Claim),
    st.sampled_from([True, False, None]),
    st.sampled_from(
        [None, OTHER, READY, replace(OTHER, role=StandbyRole.LEAVING), replace(OTHER, fingerprint=8)]
    ),
    st.floats(LOOK, 8),
    st.booleans(),
)


@given(st.lists(EVENTS, max_size=12), st.booleans())
def test_whatever_happens_nobody_serves_without_claim_and_address(
    events: list[tuple[Claim, bool | None, Heartbeat | None, float, bool]], has_address: bool
) -> None:
    rig = Rig(has_address=has_address)
    for claim, address, other, seconds, switch in events:
        rig.claim, rig.address, rig.other = claim, address, other
        if switch:
            rig.station.hand_over(rig.now)
        rig.run(min(seconds, PERIOD * 20))
        if rig.duty.serve and rig.role is StandbyRole.ACTIVE:
            assert claim is Claim.HELD
            assert address is not False or not has_address
        assert not (rig.duty.ask and rig.duty.withdraw)
        assert rig.duty.serve <= rig.role.has_claim
