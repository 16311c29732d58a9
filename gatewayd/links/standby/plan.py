"""The compiled side of a mapping that concerns the other gateway, immutable."""

from __future__ import annotations

from dataclasses import dataclass, field

from gatewayd.mapping.plan import NO_MEANING, LinkPlan

Endpoint = tuple[str, int]
"""Literal IP address and port."""


@dataclass(frozen=True, slots=True)
class StandbyPlan(LinkPlan):
    """Where the other gateway is, and what the two share.

    What differs between the two machines does not count for the fingerprint, which has to be the same on both.
    """

    kind = "standby"

    peers: tuple[Endpoint, ...] = field(metadata=NO_MEANING)
    """The other gateway; or both, and which of them is this machine its addresses tell."""
    listen: Endpoint | None = field(metadata=NO_MEANING)
    """Where this gateway hears the other; None: at its own one of two `peers`, else on all addresses."""
    address: str = ""
    """The virtual address, which moves with the cell; empty: there is none."""
