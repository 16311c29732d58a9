"""The writers of a cell that are CANopen peers: alive from their first frame, lost with their cause.

CAN knows no connections, so one is counted for each writer that is alive, and never more than one. A writer that
promised a heartbeat is believed for one heartbeat time from its first sign, and from then on only while it is heard.
One that is not believed is neither alive nor connected here, and what it asks of the cell is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from gatewayd.canopen.heartbeat import HeartbeatConsumer, Watch
from gatewayd.canopen.plan import Consumer
from gatewayd.core.cell import Cell

__all__ = ["Peers"]


class Peers:
    """The CANopen writers of one cell. A writer of None is nobody.

    `promises` names the writers that promised the heartbeat of a node, `watch` knows whether it is heard. What 1016h no
    longer has is not watched, and its writer is believed like one that promised nothing.
    """

    def __init__(self, cell: Cell, promises: Iterable[Consumer], watch: HeartbeatConsumer) -> None:
        self._cell = cell
        self._watch = watch
        self._nodes = {one.writer: one.node for one in promises if one.writer is not None}
        self._alive: set[int] = set()

    def resume(self, former: Peers) -> None:
        """The living writers of the cell that this one succeeded, by name; the cell has them counted already."""
        names = {one.name: index for index, one in enumerate(self._cell.definition.writers)}
        before = former._cell.definition.writers
        self._alive = {names[before[writer].name] for writer in former._alive if before[writer].name in names}

    def of(self, node: int) -> Iterator[int]:
        """The writers that promised this node's heartbeat."""
        return (writer for writer, promised in self._nodes.items() if promised == node)

    def believed(self, writer: int | None) -> bool:
        """Whether the writer keeps what it promised, as far as can be known yet."""
        node = self._nodes.get(writer) if writer is not None else None
        return node is None or self._watch.state(node) is not Watch.LOST

    def connect(self, writer: int | None, service: str, now: float) -> bool:
        """The writer uses a service: it is alive from now on, if it is believed. Returns whether it is."""
        if writer is None:
            return True
        node = self._nodes.get(writer)
        if node is not None and not self._watch.expect(node, now):
            return False
        if writer not in self._alive:
            self._alive.add(writer)
            self._cell.writer_connected(writer, now, f"CANopen {service}")
        return True

    def heard(self, writer: int | None, service: str, now: float) -> None:
        """The writer uses a service that does not feed its supervision by itself."""
        if self.connect(writer, service, now) and writer is not None:
            self._cell.writer_seen(writer, now)

    def heartbeat(self, node: int, now: float) -> None:
        """A frame of the node's error control: its writers still live. It makes no writer of one who wrote nothing."""
        if self._watch.state(node) is Watch.ALIVE:
            for writer in self.of(node):
                if writer in self._alive:
                    self._cell.writer_seen(writer, now)

    def lose(self, writer: int | None, reason: str, now: float) -> None:
        """The writer is lost; its locks are released and the fallbacks apply."""
        if writer is not None and writer in self._alive:
            self._alive.discard(writer)
            self._cell.writer_disconnected(writer, now, reason)

    def lose_all(self, reason: str, now: float) -> None:
        """No writer can be heard any more."""
        for writer in sorted(self._alive):
            self.lose(writer, reason, now)
