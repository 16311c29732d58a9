"""How much of a CAN bus frames take in the worst case: arithmetic of frames with 11-bit identifiers (ISO 11898-1)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

WARNING_ABOVE: Final = 0.4
"""Share of the bus above which SDO and other nodes become slow."""
ERROR_ABOVE: Final = 0.7
"""Share of the bus above which low-priority frames may wait for ever."""

_STUFFED: Final = 34
"""Bits of a frame that are stuffed, without the data: start, identifier, control, CRC (ISO 11898-1)."""
_OVERHEAD: Final = 47
"""Bits of a frame without data and stuff bits, with the three of the interframe space."""


def frame_bits(length: int) -> int:
    """Greatest length of a frame with an 11-bit identifier and `length` bytes, interframe space included, in bits."""
    return _OVERHEAD + 8 * length + (_STUFFED + 8 * length - 1) // 4


@dataclass(frozen=True, slots=True)
class Share:
    """What one frame takes of the bus."""

    what: str
    bits: int
    rate: float
    """Frames per second."""

    @property
    def bits_per_second(self) -> float:
        """Bits per second."""
        return self.bits * self.rate


def load(shares: Iterable[Share], bit_rate: int) -> float:
    """The share of the bus, 1.0 for all of it."""
    return sum(share.bits_per_second for share in shares) / bit_rate
