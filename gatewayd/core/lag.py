"""How late packages come: our clock minus the controller's timestamp, against the smallest that this was so far.

The two clocks have nothing in common but their speed, and that only nearly: the smallest offset seen (the baseline) may
rise by `DRIFT`. What an offset has above it is the lag: time that the package spent in queues, beyond what the quickest
one spent. Three things cannot be seen in it:

- a delay that was there from the first package on and never became less;
- a lag that grows more slowly than `DRIFT`, or that stays within the limit so long that `DRIFT` has made up for it;
- whether an offset that rises and stays is a backlog or a controller that paused. `doubtful` says when to ask: an
  answer of the controller queues behind the packages, so a quick one proves that there is no backlog (`probed`).

While the lag is over the limit the baseline does not rise: what is late does not become good by staying late.
"""

from __future__ import annotations

import math

DRIFT = 500e-6
"""Seconds per second by which one clock may be slower than the other. Crystals differ by less than a fifth of it; a
clock that a time service adjusts may use up the rest."""
PROBE_INTERVAL = 1.0
"""Seconds between two times that the lag is doubtful, and the least time for which it has to be steady before."""


class Lag:
    """The lag of one controller's packages. It outlives sessions: a new connection does not make a line quick."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        """Seconds from which on a package is late. Steps of the lag within half of it count as jitter."""
        self.seconds = 0.0
        """The lag of the last package."""
        self._baseline = math.inf
        self._raw = -math.inf
        self._timestamp = -math.inf
        self._level = -math.inf
        """Lag from which those of later packages differ by jitter only, since `_steady_since`."""
        self._steady_since = -math.inf
        self._asked = -math.inf

    def package(self, timestamp: float, raw: float) -> float:
        """The lag of a package with the controller's `timestamp`, read at `raw` of a clock that nobody adjusts.

        A timestamp that goes back is a controller that booted: a new baseline. One that goes back by no more than the
        limit is none, as nothing boots so soon after it booted; otherwise a clock that creeps back would never be late.
        """
        offset, baseline, limit = raw - timestamp, self._baseline, self.limit
        if self.seconds <= limit:
            drift = DRIFT * (raw - self._raw)
            # Time without packages must not let a backlog pass for drift.
            baseline += min(drift, limit / 2)
        if offset < baseline or timestamp < self._timestamp - limit:
            baseline = offset
        self._baseline, self._raw, self._timestamp = baseline, raw, timestamp
        self.seconds = lag = offset - baseline
        return lag

    def of(self, timestamp: float, raw: float) -> float:
        """The lag that `package` would find, or a little more; changes nothing."""
        return max(0.0, raw - timestamp - self._baseline)

    def stays_late(self, now: float) -> None:
        """A late package, after `package`: follow whether the lag is steady."""
        if abs(self.seconds - self._level) > self.limit / 2:
            self._level = self.seconds
            self._steady_since = now

    def in_time(self) -> None:
        """Packages come in time again."""
        self._level = -math.inf

    def doubtful(self, now: float) -> bool:
        """Whether the lag has been steady for so long that the controller should be asked; at most once a second.

        Asks for packages that are late: the caller knows whether they are.
        """
        since = max(self._steady_since + max(self.limit, PROBE_INTERVAL), self._asked + PROBE_INTERVAL)
        if now < since:
            return False
        self._asked = now
        return True

    def probed(self, delay: float) -> bool:
        """The controller answered `delay` seconds after it was asked, behind all packages that it had sent before.

        Well below the lag: these packages did not wait, the controller's clock did. The present offset becomes the
        baseline. Whether it did.
        """
        if not 0.0 <= delay < self.seconds / 2:
            return False
        self._baseline += self.seconds
        self.seconds = 0.0
        return True

    def succeed(self, former: Lag) -> None:
        """Go on where `former` stands, with this one's own limit."""
        self.seconds = former.seconds
        self._baseline = former._baseline
        self._raw, self._timestamp = former._raw, former._timestamp
        self._level, self._steady_since = former._level, former._steady_since
        self._asked = former._asked
