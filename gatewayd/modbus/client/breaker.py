"""Whether a unit is asked at all: a circuit breaker, as a table. Pure; seconds of any one clock.

A unit that does not answer costs the others of its line a time-out each time it is asked. So it is asked as usual only
while it answers. Once it counts as lost there are probes: one request, and then a pause.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class BreakerState(Enum):
    """States of a breaker."""

    CLOSED = "closed"
    """The unit answers, and is asked."""
    OPEN = "open"
    """It is not asked before the next probe is due."""
    PROBING = "probing"
    """A probe is on its way."""


class BreakerEvent(Enum):
    """What changes it."""

    ANSWERED = "answered"
    """The unit has answered, be it with an exception."""
    GIVEN_UP = "given up"
    """Too many failures in a row, or too long without an answer."""
    PROBED = "probed"
    """A request was sent although it is open."""
    FAILED = "failed"
    """A probe was not answered."""


TABLE: dict[tuple[BreakerState, BreakerEvent], BreakerState] = {
    (BreakerState.CLOSED, BreakerEvent.GIVEN_UP): BreakerState.OPEN,
    (BreakerState.OPEN, BreakerEvent.PROBED): BreakerState.PROBING,
    (BreakerState.OPEN, BreakerEvent.ANSWERED): BreakerState.CLOSED,
    (BreakerState.PROBING, BreakerEvent.ANSWERED): BreakerState.CLOSED,
    (BreakerState.PROBING, BreakerEvent.FAILED): BreakerState.OPEN,
}
"""State and event -> the next state; what is not there changes nothing."""


@dataclass(frozen=True, slots=True)
class BreakerSettings:
    """When a breaker opens, and how often it is tried again."""

    failures: int = 3
    """Requests in a row without an answer after which the unit is lost."""
    lost_after: float = 1.0
    """Seconds without an answer, from when one was wanted, after which it is lost whatever the failures are."""
    probe_every: float = 1.0
    """Seconds between the end of a failed probe and the next; a line may make it longer (`line.ProbeBudget`)."""


class Breaker:
    """That of one unit. It begins open with a probe due: a unit that was never there costs one time-out."""

    __slots__ = ("_settings", "failures", "probe_at", "state")

    def __init__(self, settings: BreakerSettings) -> None:
        self._settings = settings
        self.state = BreakerState.OPEN
        self.failures = 0
        """In a row."""
        self.probe_at = float("-inf")
        """When the next probe is due; of meaning only while open."""

    @property
    def is_closed(self) -> bool:
        """Whether the unit is asked as usual."""
        return self.state is BreakerState.CLOSED

    def answered(self) -> None:
        """The unit has answered."""
        self.failures = 0
        self._happen(BreakerEvent.ANSWERED)

    def failed(self, now: float) -> None:
        """A request to it has failed; `probe_at` is set if it is open now."""
        self.failures += 1
        if self.state is BreakerState.PROBING:
            self._happen(BreakerEvent.FAILED)
            self.probe_at = now + self._settings.probe_every
        elif self.is_closed and self.failures >= self._settings.failures:
            self.give_up(now + self._settings.probe_every)

    def give_up(self, probe_at: float) -> None:
        """Open it, with the first probe then."""
        self._happen(BreakerEvent.GIVEN_UP)
        self.probe_at = probe_at

    def probe(self) -> None:
        """A request goes out although it is open."""
        self._happen(BreakerEvent.PROBED)

    def probe_lost(self, now: float) -> None:
        """The probe was lost with the connection, which is not the unit's fault: it may be repeated at once."""
        self._happen(BreakerEvent.FAILED)
        self.probe_at = now

    def _happen(self, event: BreakerEvent) -> None:
        self.state = TABLE.get((self.state, event), self.state)
