"""Whether every part of the gateway makes progress, seen from counters that each part moves by itself.

A part counts what it cannot do without running: the core its ticks, a robot link its looks at the session, a listener
its sweeps, each the steps of a wait (`gatewayd.loop.progress`). Whether the robot or a PLC answers plays no role.
"""

from __future__ import annotations

from collections.abc import Mapping

PATIENCE = 1.0
"""Seconds for which a part may stand still before it is reported to hang: several steps, and less than the watchdog
waits, so that the journal has its name before the process is ended."""


class Progressed:
    """Whether all parts have moved since this was last the case: what a watchdog may be fed for."""

    def __init__(self) -> None:
        self._former: dict[str, int] = {}

    def all_of(self, counts: Mapping[str, int]) -> bool:
        """True at most once for each step of the slowest part.

        A part that was not among the counts before has moved if it has begun (its count is not 0).
        """
        if any(count == self._former.get(name, 0) for name, count in counts.items()):
            return False
        self._former = dict(counts)
        return True


class Liveness:
    """Remembers when each counter moved last. Times are of the monotonic clock."""

    def __init__(self, patience: float = PATIENCE) -> None:
        self._patience = patience
        self._moved: dict[str, tuple[int, float]] = {}
        self._looked = -patience

    def late(self, counts: Mapping[str, int], now: float) -> tuple[str, ...]:
        """Names of the parts that have not moved within the patience.

        A part seen for the first time counts as moved just now; one that is not among `counts` any more is forgotten.
        If this look itself comes late (the process was stopped), all parts get their patience anew: none of them
        could have moved.
        """
        held_up = now - self._looked > 0.75 * self._patience
        self._looked = now
        former = {} if held_up else self._moved
        self._moved = {
            name: former[name] if name in former and former[name][0] == count else (count, now)
            for name, count in counts.items()
        }
        return tuple(name for name, (_, moved) in self._moved.items() if now - moved > self._patience)
