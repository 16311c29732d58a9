"""The clock of one simulated controller: all that takes time there counts by it, at its speed or step by step.

It shows the time of the world outside, in the seconds of the controller: it goes on while the controller stands still,
and while its timestamp does.
"""

from __future__ import annotations

import asyncio
import heapq
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

EARLY = 1e-6
"""Seconds by which a moment may be missed: the loop calls early by its resolution, sums of periods are not exact."""


class ClockTimer(Protocol):
    """A call that is due."""

    def cancel(self) -> None:
        """It is not made."""


class SimulatorClock(Protocol):
    """What the parts of a simulator see of it."""

    @property
    def now(self) -> float:
        """Seconds, since whenever."""

    def call_at(self, when: float, callback: Callable[[], object]) -> ClockTimer:
        """Have something called when that time has come, or has passed."""


class ScaledClock:
    """The clock of the event loop, `speed` times as fast."""

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = speed

    @property
    def now(self) -> float:
        """See `SimulatorClock`."""
        return asyncio.get_running_loop().time() * self._speed

    def call_at(self, when: float, callback: Callable[[], object]) -> ClockTimer:
        """See `SimulatorClock`."""
        return asyncio.get_running_loop().call_at(when / self._speed, callback)


@dataclass(order=True, slots=True)
class _SteppedTimer:
    when: float
    number: int
    callback: Callable[[], object] | None = field(compare=False)

    def cancel(self) -> None:
        self.callback = None


class SteppedClock:
    """A clock that stands still until somebody lets a control cycle pass; `rate` of them are a second."""

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._cycles = 0
        self._timers: list[_SteppedTimer] = []
        self._number = 0

    @property
    def now(self) -> float:
        """See `SimulatorClock`; 0 at first."""
        return self._cycles / self._rate

    def call_at(self, when: float, callback: Callable[[], object]) -> ClockTimer:
        """See `SimulatorClock`: in the first cycle that begins then or later."""
        self._number += 1
        timer = _SteppedTimer(when, self._number, callback)
        heapq.heappush(self._timers, timer)
        return timer

    def step(self) -> None:
        """A cycle passes: call what is due."""
        self._cycles += 1
        while self._timers and self._timers[0].when <= self.now + EARLY:
            callback = heapq.heappop(self._timers).callback
            if callback is not None:
                callback()
