"""How often something may happen: a few times at once, and then so many times a second. Pure: time is a parameter."""

from __future__ import annotations


class Allowance:
    """At most `burst` times at once, and `rate` times a second over a long time."""

    def __init__(self, burst: int, rate: float) -> None:
        self._burst = burst
        self._rate = rate
        self._left = float(burst)
        self._since = 0.0

    def due(self, now: float) -> float:
        """When the next one is allowed; not after `now` if it is now."""
        self._refill(now)
        return now if self._left >= 1 else self._since + (1 - self._left) / self._rate

    def take(self, now: float) -> bool:
        """Use one up; False if none is allowed now."""
        self._refill(now)
        # What was refilled for `due` may be less than 1 by what rounding took.
        if self._left < 1 - 1e-9:
            return False
        self._left -= 1
        return True

    def _refill(self, now: float) -> None:
        if now > self._since:
            self._left = min(float(self._burst), self._left + (now - self._since) * self._rate)
            self._since = now
