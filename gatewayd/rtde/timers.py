"""The clocks of one connection: for answers that are due, for those to a probe, and for claims to be tried again."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

_FIRST_RETRY = 0.1


class Deadline:
    """Calls `passed` when a time is over; a new time replaces the one before."""

    def __init__(self, passed: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._passed = passed
        self._handle: asyncio.TimerHandle | None = None

    def set(self, seconds: float) -> None:
        """Let it be so many seconds from now."""
        self.cancel()
        self._handle = self._loop.call_later(seconds, self._passed)

    def cancel(self) -> None:
        """There is none any more."""
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None


class ProbeTimer:
    """Measures one probe at a time. `ended` gets the seconds until its answer; infinity: none came within `limit`."""

    def __init__(self, limit: float, ended: Callable[[float], None]) -> None:
        self.running = False
        """Whether an answer is awaited."""
        self._loop = asyncio.get_running_loop()
        self._limit = limit
        self._ended = ended
        self._asked_at = 0.0
        self._deadline = Deadline(lambda: self._end(math.inf))

    def start(self) -> None:
        """A probe is being sent."""
        self.running = True
        self._asked_at = self._loop.time()
        self._deadline.set(self._limit)

    def answered(self) -> None:
        """An answer is there; it may be that to a probe that was given up."""
        if self.running:
            self._end(self._loop.time() - self._asked_at)

    def cancel(self) -> None:
        """Wait no longer."""
        self.running = False
        self._deadline.cancel()

    def _end(self, seconds: float) -> None:
        self.cancel()
        self._ended(seconds)


class RetryTimer:
    """Calls `retry` each time that it was asked to: soon at first, then later and later, up to `longest` seconds."""

    def __init__(self, longest: float, retry: Callable[[], None]) -> None:
        self._longest = longest
        self._retry = retry
        self._delay = _FIRST_RETRY
        self._waiting = False
        self._deadline = Deadline(self._call)

    def schedule(self) -> None:
        """Call it once more; no effect while that is to be done already."""
        if not self._waiting:
            delay = min(self._delay, self._longest)
            self._delay = 2 * delay
            self._waiting = True
            self._deadline.set(delay)

    def cancel(self) -> None:
        """Call it no more."""
        self._waiting = False
        self._deadline.cancel()

    def _call(self) -> None:
        self._waiting = False
        self._retry()
