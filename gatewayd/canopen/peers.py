"""The writers of a cell that are CANopen peers: alive from their first frame, lost with their cause.

CAN knows no connections, so one is counted for each writer that is alive, and never more than one. A writer that
promised a heartbeat (`gatewayd.canopen.promise`) is not believed while that stays away, by the mapping or by 1016h.
One that is not believed is neither alive nor connected here, and what it asks of the cell is refused.
"""

from __future__ import annotations

import math
from dataclasses import replace

from gatewayd.canopen.heartbeat import HeartbeatConsumer, Watch
from gatewayd.canopen.promise import Promise, Promises
from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester, new_connection

__all__ = ["Peers"]


class Peers:
    """The CANopen writers of one cell. A writer of None is nobody."""

    def __init__(self, cell: Cell, promises: Promises, watch: HeartbeatConsumer) -> None:
        self.waited = 0.0
        """Seconds for which what is served now may have waited while the process stood still."""
        self._waiting_since = math.inf
        self._cell = cell
        self._promises = promises
        self._watch = watch
        self._alive: set[int] = set()
        self._requesters = {
            writer: Requester(writer, connection=new_connection())
            for writer in (None, *range(len(cell.definition.writers)))
        }

    def resume(self, former: Peers) -> None:
        """The living writers of the cell that this one succeeded, by name; the cell has them counted already."""
        self.waited, self._waiting_since = former.waited, former._waiting_since
        names = {one.name: index for index, one in enumerate(self._cell.definition.writers)}
        before = former._cell.definition.writers
        self._alive = {names[before[writer].name] for writer in former._alive if before[writer].name in names}
        for writer, requester in former._requesters.items():
            index = None if writer is None else names.get(before[writer].name)
            if (writer is None) is (index is None):
                self._requesters[index] = replace(requester, writer=index)

    def gap(self, since: float, now: float) -> None:
        """The process stood still: until `caught_up`, what is served may have waited so long."""
        self._waiting_since = min(self._waiting_since, since)
        self.waited = now - self._waiting_since

    def caught_up(self) -> None:
        """What is served from now on came in time."""
        self._waiting_since, self.waited = math.inf, 0.0

    def believed(self, writer: int | None) -> bool:
        """Whether the writer keeps what it promised, as far as can be known yet."""
        node = self._promises.node(writer)
        if node is None:
            return True
        return self._promises.state(node) is not Promise.BROKEN and self._watch.state(node) is not Watch.LOST

    def requester(self, writer: int | None) -> Requester:
        """The writer as a sender of requests, with what can be vouched for now."""
        requester, trusted = self._requesters[writer], self.believed(writer)
        if trusted and not self.waited:
            return requester
        return replace(requester, trusted=trusted, waited=self.waited)

    def asking(self, writer: int | None, now: float) -> Requester:
        """The writer as one that asks for a write or a lock now: what it promised binds it from the first time on."""
        self._promises.write(writer, now)
        return self.requester(writer)

    def connect(self, writer: int | None, service: str, now: float) -> bool:
        """The writer uses a service: it is alive from now on, if it is believed. Returns whether it is."""
        if writer is None:
            return True
        if not self.believed(writer):
            return False
        if writer not in self._alive:
            self._alive.add(writer)
            self._cell.writer_connected(self._requesters[writer], now, f"CANopen {service}")
        return True

    def heard(self, writer: int | None, service: str, now: float) -> None:
        """The writer uses a service that does not feed its supervision by itself."""
        if self.connect(writer, service, now) and writer is not None:
            self._cell.writer_seen(self._requesters[writer], now)

    def heartbeat(self, node: int, now: float) -> None:
        """The node's heartbeat: its writers still live. It makes no writer of one who wrote nothing."""
        for writer in self._promises.of(node):
            if writer in self._alive:
                self._cell.writer_seen(self._requesters[writer], now)

    def lose(self, writer: int | None, reason: str, now: float) -> None:
        """The writer is lost; its locks are released and the fallbacks apply."""
        if writer is not None and writer in self._alive:
            self._alive.discard(writer)
            self._cell.writer_disconnected(self._requesters[writer], now, reason, at_once=True)

    def lose_all(self, reason: str, now: float) -> None:
        """No writer can be heard any more."""
        for writer in sorted(self._alive):
            self.lose(writer, reason, now)
