"""Locks change hands: by writing and requesting, with time, with the end of a connection and the loss of a writer.

Whatever ends an ownership gives the members their `on_release`: a release all of them, a takeover those that its
request does not write, so that nobody inherits a command. Taking a free group that several writers may own does the
same to members that were only adopted: another of them may have left those. Every change is an event.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from gatewayd.core.definition import Value
from gatewayd.core.events import Event, EventKind
from gatewayd.core.ownership import LockTable, Move
from gatewayd.core.requester import Requester
from gatewayd.core.supervision import WriterTable


@dataclass(slots=True, eq=False)
class Locking:
    """Carries out what becomes of the locks of one cell."""

    _ownership: LockTable
    _writers: WriterTable
    _record: Callable[[Event], None]
    _fall_back: Callable[[Iterable[int], float], None]
    _inherited: Callable[[int, int], list[int]]
    """The members of a free lock that fall back when this writer takes it."""
    _notify: Callable[[], None]
    """Says that inputs have changed."""

    def move(
        self,
        requester: Requester,
        moves: Mapping[int, Move],
        now: float,
        written: Sequence[tuple[int, Value]] = (),
    ) -> bool:
        """The requester acquires, renews or takes over. What it inherits and does not write falls back.

        Returns whether something did. The caller sets what is written and notifies, so that the robot gets all of it
        in one package.
        """
        writer, connection = requester.writer, requester.connection
        assert writer is not None
        table = self._ownership
        owners, locks, connections = table.owners, table.locks, table.connections
        dropped: list[int] = []
        for lock, move in moves.items():
            former = owners[lock]
            connections[lock] = connection
            if former == writer and locks[lock].lease is None:
                continue
            table.apply(lock, writer, move, now)
            if former == writer:
                continue
            if move is Move.ACQUIRE:
                self._record(Event(now, EventKind.ACQUIRED, lock=lock, writer=writer))
                dropped += self._inherited(lock, writer)
            elif move is Move.TAKE_OVER:
                self._record(Event(now, EventKind.TAKEN_OVER, lock=lock, writer=writer, other=former))
                dropped += locks[lock].members
        if table.orphans:
            for lock in moves:
                table.orphans.pop(lock, None)
        if dropped:
            given = {index for index, _value in written}
            self._fall_back([index for index in dropped if index not in given], now)
        return bool(dropped)

    def take(self, requester: Requester, lock: int, move: Move, now: float) -> None:
        """The requester takes or renews a lock without writing."""
        if self.move(requester, {lock: move}, now):
            self._notify()

    def renew(self, requester: Requester, moves: Mapping[int, Move], now: float) -> None:
        """Of a request that is refused for the robot's sake only the renewals are carried out."""
        self.move(requester, {lock: move for lock, move in moves.items() if move is Move.RENEW}, now)

    def free(self, locks: Sequence[int], now: float, detail: str) -> None:
        """Release these locks of any owner; release fallbacks apply."""
        for lock in locks:
            owner = self._ownership.free(lock)
            self._record(Event(now, EventKind.RELEASED, lock=lock, writer=owner, detail=detail))
        self._fall_back([index for lock in locks for index in self._ownership.locks[lock].members], now)
        if locks:
            self._notify()

    def drop(self, requester: Requester, locks: Iterable[int], now: float, detail: str) -> None:
        """Release those of these locks that the requester's writer owns."""
        if requester.writer is not None:
            mine = set(locks).intersection(self._ownership.held_by(requester.writer))
            self.free(sorted(mine), now, detail)

    def disconnected(self, requester: Requester, now: float, reason: str, *, at_once: bool) -> None:
        """A connection of the requester's writer has ended, and with it what follows it, after the writer's grace."""
        writer = requester.writer
        if writer is None:
            return
        if self._writers.disconnected(writer, now, at_once=at_once):
            self._lost(writer, now, reason)
            return
        ended = self._ownership.held_through(writer, requester.connection)
        grace = self._writers.writers[writer].grace
        if grace and not at_once:
            self._ownership.orphans.update(dict.fromkeys(ended, now + grace))
        else:
            self.free(ended, now, f"its connection ended: {reason}")

    def following(self, requesters: Collection[Requester]) -> set[int]:
        """The locks that would end at once with all these connections."""
        found: set[int] = set()
        ending = Counter(requester.writer for requester in requesters)
        for requester in requesters:
            writer = requester.writer
            if writer is None:
                continue
            whole = self._writers.alive[writer] and ending[writer] >= self._writers.connections[writer]
            held = self._ownership.held_by(writer)
            found.update(held if whole else self._ownership.held_through(writer, requester.connection))
        return found

    def expire(self, now: float) -> None:
        """Release what time has ended: leases, and what nobody went on with after its connection was gone."""
        expired = self._ownership.expired(now)
        if expired:
            self.free(expired, now, "lease ended")
        for writer in self._writers.gone(now):
            self._writers.lose(writer)
            self._lost(writer, now, self._grace_passed(writer))
        if self._ownership.orphans:
            for lock in self._ownership.orphaned(now):
                owner = self._ownership.owners[lock]
                assert owner is not None
                self.free([lock], now, self._grace_passed(owner))

    def silence(self, now: float) -> None:
        """Count the writers as lost that were silent for too long."""
        for writer in self._writers.silent(now):
            declared = self._writers.writers[writer]
            self._writers.lose(writer)
            what = "write" if declared.counts_writes else "request"
            self._lost(writer, now, f"no {what} for {declared.timeout:g} s")

    def gap(self, since: float, now: float) -> None:
        """The gateway stood still: what could not be received in this time counts against nobody."""
        orphans, owners = self._ownership.orphans, self._ownership.owners
        for lock, end in orphans.items():
            owner = owners[lock]
            assert owner is not None
            orphans[lock] = self._writers.extended(end, owner, since, now)
        self._writers.gap(since, now)

    def _lost(self, writer: int, now: float, reason: str) -> None:
        self._record(Event(now, EventKind.WRITER_LOST, writer=writer, detail=reason))
        self.free(self._ownership.held_by(writer), now, f"owner lost: {reason}")

    def _grace_passed(self, writer: int) -> str:
        return f"connection gone for {self._writers.writers[writer].grace:g} s"
