"""The writers of a cell that are CANopen peers: alive from their first frame, lost with their cause.

CAN knows no connections, so one is counted for each writer that is alive, and never more than one. A writer that
promised a heartbeat (`canopen_node.promise`) is not believed while that stays away, by the mapping or by 1016h.
One that is not believed is neither alive nor connected here, and what it asks of the cell is refused.
"""

from __future__ import annotations

from dataclasses import replace

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.gap import Waiting
from gatewayd.canopen.heartbeat import HeartbeatConsumer, Watch
from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester, new_connection
from gatewayd.links.canopen_node.plan import GUARDING
from gatewayd.links.canopen_node.promise import Promise, Promises


class Peers:
    """The CANopen writers of one cell. A writer of None is nobody."""

    def __init__(self, cell: Cell, promises: Promises, watch: HeartbeatConsumer, waiting: Waiting) -> None:
        self._cell = cell
        self._promises = promises
        self._watch = watch
        self._waiting = waiting
        self._alive: set[int] = set()
        self._requesters = {
            writer: Requester(writer, connection=new_connection())
            for writer in (None, *range(len(cell.definition.writers)))
        }

    def resume(self, former: Peers) -> None:
        """The living writers of the cell that this one succeeded, by name; the cell has them counted already."""
        names = {writer.name: index for index, writer in enumerate(self._cell.definition.writers)}
        before = former._cell.definition.writers
        self._alive = {names[before[writer].name] for writer in former._alive if before[writer].name in names}
        for writer, requester in former._requesters.items():
            index = None if writer is None else names.get(before[writer].name)
            if (writer is None) is (index is None):
                self._requesters[index] = replace(requester, writer=index)

    def believed(self, writer: int | None) -> bool:
        """Whether the writer keeps what it promised, as far as can be known yet."""
        node = self._promises.node(writer)
        if node is None:
            return True
        return self._promises.state(node) is not Promise.BROKEN and self._watch.state(node) is not Watch.LOST

    def requester(self, writer: int | None) -> Requester:
        """The writer as a sender of requests, with what can be vouched for now."""
        requester, trusted = self._requesters[writer], self.believed(writer)
        if trusted and not self._waiting.seconds:
            return requester
        return replace(requester, trusted=trusted, waited=self._waiting.seconds)

    def asking(self, writer: int | None, now: float) -> Requester:
        """The writer as one that asks for a write or a lock now: what it promised binds it from the first time on."""
        self._promises.write(writer, now)
        return self.requester(writer)

    def by_rpdo(self, writer: int | None, now: float) -> Requester:
        """The writer as the sender of an RPDO, which is a sign of its life."""
        self._promises.write(writer, now)
        self.connect(writer, "RPDO", now)
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

    def heartbeat(self, frame: Frame, now: float) -> None:
        """A watched node's heartbeat: its writers still live. It makes no writer of one who wrote nothing."""
        self._watch.receive(frame, now)
        if self._promises.receive(frame, now):
            self._seen(frame.can_id - Function.ERROR_CONTROL, now)

    def guarded(self, now: float) -> None:
        """The master that guards this node asks it: so does a heartbeat."""
        self._promises.heard(GUARDING, now)
        self._seen(GUARDING, now)

    def _seen(self, node: int, now: float) -> None:
        for writer in self._promises.of(node):
            if writer in self._alive:
                self._cell.writer_seen(self._requesters[writer], now)

    def lose(self, writer: int | None, reason: str, now: float) -> None:
        """The writer is lost; its locks are released and the fallbacks apply."""
        if writer is not None and writer in self._alive:
            self._alive.discard(writer)
            self._cell.writer_disconnected(self._requesters[writer], now, reason, at_once=True)

    def living(self) -> list[Requester]:
        """The writers that are alive."""
        return [self._requesters[writer] for writer in sorted(self._alive)]

    def lose_all(self, reason: str, now: float) -> None:
        """No writer can be heard any more."""
        for writer in sorted(self._alive):
            self.lose(writer, reason, now)
