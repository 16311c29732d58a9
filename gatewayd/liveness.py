"""Which parts of the gateway have stopped turning, seen from counters that each part moves by itself.

A part counts what it cannot do without running: the core its ticks, a robot link its connection attempts and its looks
at a running session, a listener its sweeps. Whether the robot or a PLC answers plays no role.
"""

from __future__ import annotations

from collections.abc import Mapping

__all__ = ["PATIENCE", "Liveness"]

PATIENCE = 5.0
"""Seconds for which a part may stand still. Each allows itself waits of two seconds at most: for a connection, for an
answer, before it tries again."""


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
        held_up = now - self._looked > self._patience / 2
        self._looked = now
        former = {} if held_up else self._moved
        self._moved = {
            name: former[name] if name in former and former[name][0] == count else (count, now)
            for name, count in counts.items()
        }
        return tuple(name for name, (_, moved) in self._moved.items() if now - moved > self._patience)
