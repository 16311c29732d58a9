"""Whether the robot reports in time: a state machine over packages, silence, lag and a timestamp that stands still."""

from __future__ import annotations

import math
from enum import Enum, IntEnum


class Source(IntEnum):
    """State of the robot as a source of values. The numbers stand in the status block: never renumber."""

    LOST = 0
    """No connection."""
    WAITING = 1
    """Connected, no package yet."""
    FRESH = 2
    SILENT = 3
    """Connected, but no package came for longer than `stale_after`."""
    FROZEN = 4
    """Packages come, but the controller's timestamp stands still."""
    LATE = 5
    """Packages come, but what they report is older than `stale_after`."""


class SourceSignal(Enum):
    """What moves the state."""

    CONNECTED = "connected"
    PROGRESS = "package with a new timestamp"
    NO_PACKAGE = "no package for too long"
    NO_PROGRESS = "timestamp unchanged for too long"
    TOO_LATE = "package that is older than stale_after"
    LOST = "connection lost"


TRANSITIONS: dict[tuple[Source, SourceSignal], Source] = {
    (Source.LOST, SourceSignal.CONNECTED): Source.WAITING,
    (Source.WAITING, SourceSignal.PROGRESS): Source.FRESH,
    (Source.WAITING, SourceSignal.NO_PROGRESS): Source.FROZEN,
    (Source.WAITING, SourceSignal.TOO_LATE): Source.LATE,
    (Source.WAITING, SourceSignal.LOST): Source.LOST,
    (Source.FRESH, SourceSignal.NO_PACKAGE): Source.SILENT,
    (Source.FRESH, SourceSignal.NO_PROGRESS): Source.FROZEN,
    (Source.FRESH, SourceSignal.TOO_LATE): Source.LATE,
    (Source.FRESH, SourceSignal.LOST): Source.LOST,
    (Source.SILENT, SourceSignal.PROGRESS): Source.FRESH,
    (Source.SILENT, SourceSignal.NO_PROGRESS): Source.FROZEN,
    (Source.SILENT, SourceSignal.TOO_LATE): Source.LATE,
    (Source.SILENT, SourceSignal.LOST): Source.LOST,
    (Source.FROZEN, SourceSignal.PROGRESS): Source.FRESH,
    (Source.FROZEN, SourceSignal.NO_PACKAGE): Source.SILENT,
    (Source.FROZEN, SourceSignal.TOO_LATE): Source.LATE,
    (Source.FROZEN, SourceSignal.LOST): Source.LOST,
    (Source.LATE, SourceSignal.PROGRESS): Source.FRESH,
    (Source.LATE, SourceSignal.NO_PACKAGE): Source.SILENT,
    (Source.LATE, SourceSignal.NO_PROGRESS): Source.FROZEN,
    (Source.LATE, SourceSignal.LOST): Source.LOST,
}
"""A pair that is not listed leaves the state as it is."""


class Freshness:
    """Follows one source. `stale_after` is in seconds; times are of the monotonic clock.

    A package is as old as it is late. Once late, the source is fresh again when the lag is no more than half of
    `stale_after`: at the limit itself it would go to and fro with every package.
    """

    def __init__(self, stale_after: float) -> None:
        self.stale_after = stale_after
        self.state = Source.LOST
        self.timestamp: float | None = None
        """The controller's own time in the last package."""
        self.last_package = -math.inf
        """When the last package came."""
        self.last_arrival = -math.inf
        """When the last package with a new timestamp came."""
        self.last_progress = -math.inf
        """When what that package reports was so: it came later by its lag."""

    def connected(self) -> None:
        """A session with the controller has begun. One that was frozen and still is does not pass for fresh by it."""
        self._move(SourceSignal.CONNECTED)

    def lost(self) -> None:
        """The session has ended."""
        self._move(SourceSignal.LOST)

    def package(self, timestamp: float | None, now: float, lag: float = 0.0) -> bool:
        """A package came, `lag` seconds late. Whether it reports anything to be shown: new and not too old.

        It is new if its timestamp differs from the last one's. A controller whose recipe has no timestamp (None) is
        believed; a timestamp that is no number never moves on. A package outside a session reports nothing.
        """
        if self.state is Source.LOST:
            return False
        self.last_package = now
        if timestamp is not None and (timestamp == self.timestamp or not math.isfinite(timestamp)):
            if self.state is Source.WAITING:
                self._move(SourceSignal.NO_PROGRESS)
            return False
        self.timestamp = timestamp
        self.last_arrival = now
        self.last_progress = now - lag
        limit = self.stale_after / 2 if self.state is Source.LATE else self.stale_after
        self._move(SourceSignal.TOO_LATE if lag > limit else SourceSignal.PROGRESS)
        return self.state is Source.FRESH

    def tick(self, now: float) -> None:
        """Notice that what was reported last is too old, and by what: lag most of all, a frozen timestamp, silence."""
        limit = self.stale_after
        if self.state in (Source.LOST, Source.WAITING) or now - self.last_progress <= limit:
            return
        if self.last_arrival - self.last_progress > limit / 2 and now - self.last_arrival <= limit:
            self._move(SourceSignal.TOO_LATE)
        elif self.last_package > self.last_arrival and now - self.last_package <= limit:
            self._move(SourceSignal.NO_PROGRESS)
        else:
            self._move(SourceSignal.NO_PACKAGE)

    def succeed(self, former: Freshness) -> None:
        """Go on where `former` stands, with this one's own `stale_after`."""
        self.state = former.state
        self.timestamp = former.timestamp
        self.last_package = former.last_package
        self.last_arrival = former.last_arrival
        self.last_progress = former.last_progress

    def _move(self, signal: SourceSignal) -> None:
        self.state = TRANSITIONS.get((self.state, signal), self.state)
