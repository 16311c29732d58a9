"""What kinds of links put on CAN buses: each says its own part, and rules judge a bus with all that is on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gatewayd.canopen.load import Share
from gatewayd.mapping.diagnostics import Position


@dataclass(frozen=True, slots=True)
class BusUse:
    """A node on a bus that a mapping declares."""

    interface: str
    channel: str
    bitrate: int
    node: int
    what: str
    """In a finding: `the device \\`encoder\\``."""
    position: Position
    """Where its node-ID is declared."""
    bitrate_position: Position
    sends: Mapping[int, str]
    """COB-IDs of PDOs that it sends, and what they are."""
    shares: tuple[Share, ...]
    """What it takes of the bus."""

    @property
    def bus(self) -> tuple[str, str]:
        """Which bus it is on."""
        return self.interface, self.channel
