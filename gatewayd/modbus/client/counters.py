"""What is counted of one unit."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field


@dataclass(slots=True)
class RoundTrip:
    """Times from sending a request to its answer, in seconds."""

    count: int = 0
    last: float = 0.0
    total: float = 0.0
    greatest: float = 0.0

    @property
    def mean(self) -> float:
        """Of all; 0 before the first."""
        return self.total / self.count if self.count else 0.0

    def add(self, seconds: float) -> None:
        """Another answer."""
        self.count += 1
        self.last = seconds
        self.total += seconds
        self.greatest = max(self.greatest, seconds)


@dataclass(slots=True)
class UnitCounters:
    """Since the station was made; nothing is ever set back."""

    requests: int = 0
    """That were sent."""
    answers: int = 0
    """With data or an echo."""
    time_outs: int = 0
    late_answers: int = 0
    """Answers that came after their time-out; on TCP only, where they can be told from others."""
    bad_answers: int = 0
    """Of a wrong length, with a wrong echo, or no frames."""
    lost_requests: int = 0
    """That were on their way when the connection ended."""
    exceptions: Counter[int] = field(default_factory=Counter)
    """By exception code."""
    writes: int = 0
    """That the unit has confirmed."""
    dropped_writes: int = 0
    """That were never confirmed: the unit was lost or refused, or a newer one came in time."""
    losses: int = 0
    """How often the unit was lost."""
    round_trip: RoundTrip = field(default_factory=RoundTrip)
