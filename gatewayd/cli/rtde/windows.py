"""Which packages a recording takes: those at which a condition holds, and what comes shortly before and after. Pure.

Times are seconds that never go back, as `StreamClock` makes them of the controller's timestamps.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from gatewayd.cli.rtde.conditions import Test
from gatewayd.rtde.recipe import Scalar

_Item = TypeVar("_Item")

MAX_BEFORE = 200_000
"""Packages that are kept at most for the time before a condition holds; the oldest go first."""
_MAX_VALUES = 10_000_000  # of those packages together: some 300 MB


def most_before(values: int) -> int:
    """How many packages of so many values each can be kept."""
    return min(MAX_BEFORE, _MAX_VALUES // max(1, values))


class StreamClock:
    """The controller's time, going on where it begins anew: `period` seconds after the package before."""

    def __init__(self, period: float) -> None:
        self.period = period
        self._last: float | None = None
        self.now = 0.0
        """Seconds since the first package."""

    def tick(self, timestamp: float | None) -> float:
        """Take in the timestamp of a package, None if it has none; `now` of it."""
        last, self._last = self._last, timestamp
        if timestamp is None or not (timestamp if last is None else last) <= timestamp < math.inf:
            self.now += self.period
        elif last is not None:
            self.now += timestamp - last
        return self.now


class Trigger(Protocol):
    """Says of each package whether it is one to be recorded for its own sake."""

    over: bool
    """No further one will be."""

    def active(self, values: Sequence[Scalar]) -> bool:
        """Whether it is. To be asked once for each package, in their order."""


@dataclass(slots=True)
class Always:
    """Every package."""

    over: bool = False

    def active(self, values: Sequence[Scalar]) -> bool:
        """True."""
        return True


@dataclass(slots=True)
class WhileTrue:
    """Every package at which a condition holds; `once`: until it does not hold any more."""

    test: Test
    once: bool = False
    over: bool = False
    _begun: bool = False

    def active(self, values: Sequence[Scalar]) -> bool:
        """See `Trigger`."""
        found = not self.over and self.test(values)
        self.over = self.over or (self.once and self._begun and not found)
        self._begun = self._begun or found
        return found


@dataclass(slots=True)
class StartStop:
    """From the first package at which `start` holds (None: the first of all) to the next at which `stop` does.

    Both are included. At the very first package that starts it, `stop` is not asked for.
    """

    start: Test | None = None
    stop: Test | None = None
    over: bool = False
    _begun: bool = False

    def active(self, values: Sequence[Scalar]) -> bool:
        """See `Trigger`."""
        if self.over:
            return False
        if not self._begun:
            self._begun = self.start is None or self.start(values)
            return self._begun
        self.over = self.stop is not None and self.stop(values)
        return True


class Windows(Generic[_Item]):
    """The packages that are active, and all within `before` and `after` seconds of one that is."""

    def __init__(self, before: float = 0.0, after: float = 0.0, limit: int = MAX_BEFORE) -> None:
        self._before = before
        self._after = after
        self._ring: deque[tuple[float, _Item]] = deque(maxlen=limit)
        self._active_at: float | None = None
        self.left_out = 0
        """Packages before the ones that `take` returned last that are in no window."""
        self._passed = 0

    def take(self, item: _Item, time: float, *, active: bool) -> list[_Item]:
        """Take in a package; the packages that are to be recorded now, in their order."""
        while self._ring and time - self._ring[0][0] > self._before:
            self._ring.popleft()
        if active:
            self._active_at = time
        if self._active_at is not None and time - self._active_at <= self._after:
            found = [*(kept for _at, kept in self._ring), item]
            self._ring.clear()
            self.left_out, self._passed = self._passed - len(found) + 1, 0
            return found
        self._passed += 1
        self._ring.append((time, item))
        return []

    @property
    def open(self) -> bool:
        """Whether the newest package was recorded."""
        return self._passed == 0 and self._active_at is not None
