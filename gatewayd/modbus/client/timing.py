"""The silences of a serial line (Modbus over Serial Line V1.02, 2.4.1 and 2.5.1.1); seconds throughout."""

from __future__ import annotations

from dataclasses import dataclass

_GAP_CHARACTERS = 3.5
_FIXED_ABOVE = 19_200
"""Bits per second above which the gap does not become shorter."""
_FIXED_GAP = 0.001_75
TURNAROUND = 0.1
"""After a broadcast, for the units to do what it says; the specification has 100 ms to 200 ms."""


@dataclass(frozen=True, slots=True)
class RtuTiming:
    """How long what takes on a serial line."""

    gap: float
    """Silence between two frames."""
    character: float
    turnaround: float = TURNAROUND
    """Silence after a broadcast."""

    @classmethod
    def of(cls, baudrate: int, bits: int = 11, turnaround: float = TURNAROUND) -> RtuTiming:
        """For `baudrate` bits per second and `bits` for each character, with start, parity and stop bits."""
        character = bits / baudrate
        gap = _FIXED_GAP if baudrate > _FIXED_ABOVE else _GAP_CHARACTERS * character
        return cls(gap, character, turnaround)

    @classmethod
    def behind_server(cls, turnaround: float = TURNAROUND) -> RtuTiming:
        """For RTU over TCP: the serial server keeps the gaps of its line."""
        return cls(0.0, 0.0, turnaround)

    def transmission(self, size: int) -> float:
        """How long `size` bytes take."""
        return size * self.character
