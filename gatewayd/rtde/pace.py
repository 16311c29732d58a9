"""How regularly packages come: measured frequency, packages skipped by the controller, packages late on the way."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from gatewayd.rtde.strange import StrangeCounts

_LONGEST_GAP = 3600.0
"""Seconds between packages beyond which the timestamp is not believed; a connection does not live so long silent."""
_EXCUSED = 1.0
"""Seconds for which what waited while we stood still is read."""
_PAUSE = 0.1
_PAUSE_PERIODS = 5.5
"""A controller that skips is too busy for some packages; one that stays away for longer than both of these pauses."""


@dataclass(slots=True)
class Statistics:
    """Counters of a client, over all its sessions."""

    sessions: int = 0
    """Set-ups completed."""
    packages: int = 0
    """Data packages received."""
    skipped: int = 0
    """Packages that the controller did not send, by the gaps between timestamps; pauses have none."""
    pauses: int = 0
    """Gaps between timestamps that are too long for that: the controller sent nothing at all for a while."""
    late: int = 0
    """Packages that came more than a period later after their predecessor than their timestamps say."""
    overtaken: int = 0
    """Packages that were not taken, because newer ones came together with them and they had waited too long."""
    writes: int = 0
    """Input packages sent."""
    frequency: float = 0.0
    """Packages per second, measured lately."""
    progress: int = 0
    """Moves several times a second while the client works, whatever the controller does."""
    strange: StrangeCounts = field(default_factory=StrangeCounts)
    """Packages that could not be taken as they came."""


class Pace:
    """The rhythm of one session. `statistics` is counted on."""

    __slots__ = (
        "_arrival",
        "_excused_until",
        "_pause",
        "_period",
        "_resumed",
        "_statistics",
        "_window_packages",
        "_window_start",
        "timestamp",
    )

    def __init__(self, period: float, statistics: Statistics, now: float) -> None:
        self._period = period
        self._statistics = statistics
        self.timestamp: float | None = None
        """Controller time of the newest package."""
        self._arrival = now
        self._window_start = now
        self._window_packages = 0
        self._resumed = False
        self._excused_until = -math.inf
        self._pause = max(_PAUSE, _PAUSE_PERIODS * period)
        statistics.frequency = 0.0

    def package(self, timestamp: float, now: float) -> bool:
        """Count a package; False if the controller's time went back or leapt, that is, if it has restarted."""
        self._window_packages += 1
        statistics = self._statistics
        statistics.packages += 1
        last, self.timestamp = self.timestamp, timestamp
        arrival, self._arrival = self._arrival, now
        if last is None:
            return True
        elapsed = timestamp - last
        if not 0.0 <= elapsed <= _LONGEST_GAP:
            return False
        resumed, self._resumed = self._resumed, False
        if elapsed > 1.5 * self._period and not resumed and now > self._excused_until:
            if elapsed > self._pause:
                statistics.pauses += 1
            else:
                statistics.skipped += round(elapsed / self._period) - 1
        if now - arrival - elapsed > self._period:
            statistics.late += 1
        return True

    def resume(self) -> None:
        """The output was paused by us and goes on: nothing is missing before the next package."""
        self._resumed = True

    def gap(self, now: float) -> None:
        """We stood still until now: not all had room to wait, and what is missing was no fault of the controller."""
        self._excused_until = now + _EXCUSED

    def measure(self, now: float) -> None:
        """Close the present window of the frequency measurement; call every second or so."""
        span = now - self._window_start
        if span > 0.0:
            self._statistics.frequency = self._window_packages / span
        self._window_start = now
        self._window_packages = 0
