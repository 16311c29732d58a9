"""Which writers are alive: their connections, and the time since their last request."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from gatewayd.core.definition import OPERATOR, Lock, Writer

DEFAULT_PATIENCE = 0.5
"""Seconds for which a request may have waited where nothing declares how long its writer may be silent."""


def patience(writer: Writer, leases: Iterable[float | None] = ()) -> float:
    """Seconds for which a request of the writer may have waited while the gateway stood still.

    The shortest of what supervises the writer and of the leases that the request would begin or renew: who was silent
    for longer would have lost them.
    """
    limits = (writer.timeout, writer.heartbeat, *leases)
    return min((limit for limit in limits if limit is not None), default=DEFAULT_PATIENCE)


class WriterTable:
    """Liveness by writer index. A writer is alive from its first connection or request until it is lost.

    Where only writes feed its time-out, nothing else is a sign of life, its connection neither: a viewer on the same
    address makes nobody alive.
    """

    def __init__(self, writers: Sequence[Writer], locks: Sequence[Lock] = ()) -> None:
        self.writers = tuple(writers)
        self.alive = [False] * len(writers)
        self.connections = [0] * len(writers)
        self.last_seen = [-math.inf] * len(writers)
        """Time of the last sign of life."""
        self.ends = [math.inf] * len(writers)
        """When the grace after the last connection has passed; infinity while there is one."""
        self._timeouts = [math.inf if writer.timeout is None else writer.timeout for writer in writers]
        self._counts_writes = [writer.counts_writes and writer.timeout is not None for writer in writers]
        self._excused = [-math.inf] * len(writers)
        """Silence counts from here on at the earliest: before it was the gateway that did not hear."""
        self._patience = [
            patience(writer, (lock.lease for lock in locks if index in lock.owners))
            for index, writer in enumerate(writers)
        ]
        self._next_end = math.inf

    def connected(self, writer: int, now: float) -> bool:
        """One connection more; returns whether the writer has just come alive."""
        self.connections[writer] += 1
        self.ends[writer] = math.inf
        return self.seen(writer, now)

    def seen(self, writer: int, now: float, *, wrote: bool = False) -> bool:
        """The writer asked for something; `wrote`: to write or to own it. Whether the writer has just come alive."""
        if self._counts_writes[writer] and not wrote:
            return False
        self.last_seen[writer] = now
        if self.alive[writer]:
            return False
        self.alive[writer] = True
        return True

    def disconnected(self, writer: int, now: float, *, at_once: bool = False) -> bool:
        """One connection less. Whether a living writer is lost by it: it was the last one, and there is no grace."""
        self.connections[writer] = max(0, self.connections[writer] - 1)
        if self.connections[writer]:
            return False
        grace = self.writers[writer].grace
        if at_once or not grace:
            return self.lose(writer)
        if self.alive[writer]:
            self.ends[writer] = end = now + grace
            self._next_end = min(self._next_end, end)
        return False

    def lose(self, writer: int) -> bool:
        """Count the writer as lost; returns whether it was alive."""
        self.ends[writer] = math.inf
        was_alive, self.alive[writer] = self.alive[writer], False
        return was_alive

    def gone(self, now: float) -> list[int]:
        """The writers without a connection whose grace has passed. Cheap while none can have."""
        if now < self._next_end:
            return []
        ended = [writer for writer, end in enumerate(self.ends) if end <= now]
        self._next_end = min((end for end in self.ends if end > now), default=math.inf)
        return ended

    def silent(self, now: float) -> list[int]:
        """The living writers whose time-out has passed without a sign of life."""
        return [
            index
            for index, (limit, excused) in enumerate(zip(self._timeouts, self._excused, strict=True))
            if self.alive[index] and now - max(self.last_seen[index], excused) > limit
        ]

    def gap(self, since: float, now: float) -> None:
        """Nothing could be received from `since` to `now`: that time is no silence of any writer.

        After a gap in which what a writer sent has become too old to count, its supervision begins anew. Not after a
        shorter one: else many short gaps would keep a dead writer alive.
        """
        length = now - since
        for index, limit in enumerate(self._patience):
            counted_from = max(self.last_seen[index], self._excused[index])
            self._excused[index] = now if length > limit else min(now, counted_from + length)
            self.ends[index] = self.extended(self.ends[index], index, since, now)
        self._next_end = min(self.ends, default=math.inf)

    def extended(self, end: float, writer: int, since: float, now: float) -> float:
        """When a grace of the writer ends that should have ended at `end`, after such a gap."""
        if end == math.inf:
            return end
        length = now - since
        return now + self.writers[writer].grace if length > self._patience[writer] else end + length

    def succeed(self, former: WriterTable, writers: Mapping[int, int], now: float) -> None:
        """Go on with the life of the former table's writers; `writers`: its indices to those here.

        Supervision by another rule begins anew: nobody had to keep it before.
        """
        for source, target in writers.items():
            if source == OPERATOR:
                continue
            self.alive[target] = former.alive[source]
            self.connections[target] = former.connections[source]
            self.last_seen[target] = former.last_seen[source]
            self.ends[target] = former.ends[source]
            same = self._rule(target) == former._rule(source)
            self._excused[target] = former._excused[source] if same else now
        self._next_end = min(self.ends, default=math.inf)

    def _rule(self, writer: int) -> tuple[float, bool]:
        return self._timeouts[writer], self._counts_writes[writer]
