"""The claim of a session in the words of all source links."""

from __future__ import annotations

from gatewayd.links.contract import Claim
from gatewayd.links.robot.claiming import claim_of
from gatewayd.rtde.claims import ClaimStanding


def test_every_standing_has_its_word() -> None:
    assert {claim_of(standing, adopted=True) for standing in (None, *ClaimStanding)} == set(Claim)


def test_a_claim_is_held_once_its_inputs_were_read() -> None:
    assert claim_of(ClaimStanding.HELD, adopted=False) is Claim.ASKED
    assert claim_of(None, adopted=True) is Claim.NO_SESSION
