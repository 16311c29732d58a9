"""The writers of a cell that are CANopen peers: alive from their first frame, lost with their cause.

CAN knows no connections, so one is counted for each writer that is alive, and never more than one.
"""

from __future__ import annotations

from gatewayd.core.cell import Cell

__all__ = ["Peers"]


class Peers:
    """The CANopen writers of one cell. A writer of None is nobody."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._alive: set[int] = set()

    def resume(self, former: Peers) -> None:
        """The living writers of the cell that this one succeeded, by name; the cell has them counted already."""
        names = {one.name: index for index, one in enumerate(self._cell.definition.writers)}
        before = former._cell.definition.writers
        self._alive = {names[before[writer].name] for writer in former._alive if before[writer].name in names}

    def connect(self, writer: int | None, service: str, now: float) -> None:
        """The writer uses a service: it is alive from now on."""
        if writer is not None and writer not in self._alive:
            self._alive.add(writer)
            self._cell.writer_connected(writer, now, f"CANopen {service}")

    def heard(self, writer: int | None, service: str, now: float) -> None:
        """The writer uses a service that does not feed its supervision by itself."""
        if writer is not None:
            self.connect(writer, service, now)
            self._cell.writer_seen(writer, now)

    def heartbeat(self, writer: int | None, now: float) -> None:
        """The node that is the writer still lives. That makes nobody a writer who has written nothing."""
        if writer in self._alive and writer is not None:
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
