"""How often, and for how long, a session is tried for: limits apart for connecting and for the set-up."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gatewayd.rtde.loss import LossReason

_CONNECTING = frozenset({LossReason.REFUSED, LossReason.UNREACHABLE, LossReason.UNRESOLVED})


@dataclass(frozen=True, slots=True)
class Retry:
    """Limits of the attempts at a session; None is no limit. Times in seconds since the first failure."""

    connect_attempts: int | None = None
    """Attempts in a row that did not get a TCP connection."""
    connect_time: float | None = None
    """Time after which no further connection is tried."""
    setup_attempts: int | None = None
    """Attempts in a row that got a connection and no session."""
    setup_time: float | None = None
    """Time after which no further set-up is tried."""
    delay: float = 0.05
    """Before the first further attempt; doubles with each failure."""
    max_delay: float = 2.0
    """Longest wait between attempts."""

    def __post_init__(self) -> None:
        for name in ("connect_attempts", "setup_attempts"):
            limit = getattr(self, name)
            if limit is not None and limit < 1:
                message = f"{name} is {limit}: at least one attempt is made; None is no limit"
                raise ValueError(message)
        if not 0 < self.delay <= self.max_delay < math.inf:
            message = f"delay {self.delay} has to be more than 0 and at most max_delay {self.max_delay}"
            raise ValueError(message)


ONCE = Retry(connect_attempts=1, setup_attempts=1)
"""One attempt."""


class Attempts:
    """The failures in a row, against the limits of a `Retry`. None: none at all may fail."""

    def __init__(self, retry: Retry | None) -> None:
        self._retry = retry
        self._since = math.inf
        self._connecting = 0
        self._setting_up = 0

    def failed(self, reason: LossReason, *, connected: bool, now: float, delay: float) -> bool:
        """Count a failure; whether another attempt is allowed, `delay` seconds from `now`."""
        retry = self._retry
        if retry is None:
            return False
        self._since = min(self._since, now)
        if connected and reason not in _CONNECTING:
            self._setting_up += 1
            return self._goes_on(self._setting_up, retry.setup_attempts, retry.setup_time, now + delay)
        self._connecting += 1
        return self._goes_on(self._connecting, retry.connect_attempts, retry.connect_time, now + delay)

    def _goes_on(self, count: int, most: int | None, seconds: float | None, then: float) -> bool:
        return (most is None or count < most) and (seconds is None or then - self._since <= seconds)
