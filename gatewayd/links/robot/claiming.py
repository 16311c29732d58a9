"""How the claim of a controller's inputs stands, in the words of all source links."""

from __future__ import annotations

from gatewayd.links.contract import Claim
from gatewayd.rtde.claims import ClaimStanding

_CLAIMS = {
    ClaimStanding.UNASKED: Claim.UNASKED,
    ClaimStanding.ASKED: Claim.ASKED,
    ClaimStanding.HELD: Claim.HELD,
    ClaimStanding.PARTIAL: Claim.PARTIAL,
    ClaimStanding.REFUSED: Claim.REFUSED,
}


def claim_of(standing: ClaimStanding | None, *, adopted: bool) -> Claim:
    """The claim of a session; None: there is none. It counts as held once what the inputs hold was `adopted`."""
    if standing is None:
        return Claim.NO_SESSION
    if standing is ClaimStanding.HELD and not adopted:
        return Claim.ASKED
    return _CLAIMS[standing]
