"""Which writers are alive: their connections, and the time since their last request."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gatewayd.core.definition import Writer

__all__ = ["WriterTable"]


class WriterTable:
    """Liveness by writer index. A writer is alive from its first connection or request until it is lost."""

    __slots__ = ("alive", "connections", "last_seen", "writers")

    def __init__(self, writers: Sequence[Writer]) -> None:
        self.writers = tuple(writers)
        self.alive = [False] * len(writers)
        self.connections = [0] * len(writers)
        self.last_seen = [-math.inf] * len(writers)

    def connected(self, writer: int, now: float) -> bool:
        """One connection more; returns whether the writer has just come alive."""
        self.connections[writer] += 1
        return self.seen(writer, now)

    def seen(self, writer: int, now: float) -> bool:
        """The writer gave a sign of life; returns whether it has just come alive."""
        self.last_seen[writer] = now
        if self.alive[writer]:
            return False
        self.alive[writer] = True
        return True

    def disconnected(self, writer: int) -> bool:
        """One connection less; returns whether that was the last one of a living writer."""
        self.connections[writer] = max(0, self.connections[writer] - 1)
        return self.connections[writer] == 0 and self.lose(writer)

    def lose(self, writer: int) -> bool:
        """Count the writer as lost; returns whether it was alive."""
        was_alive, self.alive[writer] = self.alive[writer], False
        return was_alive

    def silent(self, now: float) -> list[int]:
        """The living writers whose time-out has passed without a request."""
        return [
            index
            for index, (writer, alive, seen) in enumerate(
                zip(self.writers, self.alive, self.last_seen, strict=True)
            )
            if alive and writer.timeout is not None and now - seen > writer.timeout
        ]
