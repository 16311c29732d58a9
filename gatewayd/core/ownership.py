"""Who owns what: one table of locks, one state machine.

A lock is free or has exactly one owner. What a writer's act does follows from how the writer stands to the lock,
by the table `MOVES`; time and disconnects release, nothing else does. A request over several locks first decides
on all of them (`decide` changes nothing) and is then carried out whole (`apply`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import Enum, IntEnum

from gatewayd.core.definition import OPERATOR, Lock


class Standing(Enum):
    """How a writer stands to a lock at this moment."""

    EXCLUDED = "not among its owners"
    FREE = "free, and may be taken"
    OWNER = "owns it"
    HIGHER = "ranks above the present owner"
    LOWER = "ranks below the present owner, or the lock knows no takeover"


class Act(Enum):
    """What a writer does."""

    WRITE = "write"
    REQUEST = "request"
    RELEASE = "release"


class Move(IntEnum):
    """What becomes of the lock."""

    ACQUIRE = 0
    RENEW = 1
    TAKE_OVER = 2
    RELEASE = 3
    NOTHING = 4
    REFUSE_HELD = 5
    REFUSE_NEVER = 6


MOVES: dict[tuple[Standing, Act], Move] = {
    (Standing.EXCLUDED, Act.WRITE): Move.REFUSE_NEVER,
    (Standing.EXCLUDED, Act.REQUEST): Move.REFUSE_NEVER,
    (Standing.EXCLUDED, Act.RELEASE): Move.REFUSE_NEVER,
    (Standing.FREE, Act.WRITE): Move.ACQUIRE,
    (Standing.FREE, Act.REQUEST): Move.ACQUIRE,
    (Standing.FREE, Act.RELEASE): Move.NOTHING,
    (Standing.OWNER, Act.WRITE): Move.RENEW,
    (Standing.OWNER, Act.REQUEST): Move.RENEW,
    (Standing.OWNER, Act.RELEASE): Move.RELEASE,
    (Standing.HIGHER, Act.WRITE): Move.TAKE_OVER,
    (Standing.HIGHER, Act.REQUEST): Move.TAKE_OVER,
    (Standing.HIGHER, Act.RELEASE): Move.REFUSE_HELD,
    (Standing.LOWER, Act.WRITE): Move.REFUSE_HELD,
    (Standing.LOWER, Act.REQUEST): Move.REFUSE_HELD,
    (Standing.LOWER, Act.RELEASE): Move.REFUSE_HELD,
}


_OPERATORS = {None: Standing.FREE, OPERATOR: Standing.OWNER}
"""How the local operator stands to a lock, by its owner; to any other owner's it is HIGHER."""


class LockTable:
    """The owners of a cell's locks. Locks and writers are indices; times are monotonic seconds."""

    def __init__(self, locks: Sequence[Lock]) -> None:
        self.locks = tuple(locks)
        self.owners: list[int | None] = [None] * len(locks)
        self.expires: list[float] = [math.inf] * len(locks)
        """When the lease ends; infinity without a lease or owner."""
        self.connections = [0] * len(locks)
        """The connection by which the owner last wrote or requested it; 0: none, or nobody owns it."""
        self.changes = 0
        """How often a lock has changed hands: as long as it stands, every owner is who it was."""
        self.tenures = [0] * len(locks)
        """The same of each lock: as long as it stands, its owner has not changed."""
        self.orphans: dict[int, float] = {}
        """Locks whose connection has ended, and until when their owner may go on with them by another one."""
        self._ranks = [{writer: rank for rank, writer in enumerate(lock.owners)} for lock in locks]
        self._next_expiry = math.inf

    def standing(self, lock: int, writer: int) -> Standing:
        """How `writer` stands to `lock` now. The local operator ranks above all others, takeover or not."""
        if writer == OPERATOR:
            return _OPERATORS.get(self.owners[lock], Standing.HIGHER)
        ranks = self._ranks[lock]
        rank = ranks.get(writer)
        if rank is None:
            return Standing.EXCLUDED
        owner = self.owners[lock]
        if owner is None:
            return Standing.FREE
        if owner == writer:
            return Standing.OWNER
        outranks = owner != OPERATOR and self.locks[lock].takeover and rank < ranks[owner]
        return Standing.HIGHER if outranks else Standing.LOWER

    def decide(self, lock: int, writer: int, act: Act) -> Move:
        """What `act` would do; changes nothing."""
        return MOVES[self.standing(lock, writer), act]

    def apply(self, lock: int, writer: int, move: Move, now: float) -> None:
        """Carry out a move that `decide` returned; refusals and NOTHING change nothing."""
        if move <= Move.TAKE_OVER:
            if self.owners[lock] != writer:
                self._change(lock)
            self.owners[lock] = writer
            lease = self.locks[lock].lease
            if lease is not None:
                self.expires[lock] = expiry = now + lease
                self._next_expiry = min(self._next_expiry, expiry)
        elif move is Move.RELEASE:
            self.free(lock)

    def renew(self, locks: slice, connection: int, expiry: float | None) -> None:
        """Neighbouring locks were written by their owner through this connection; their leases last until `expiry`."""
        count = locks.stop - locks.start
        self.connections[locks] = [connection] * count
        if expiry is not None:
            self.expires[locks] = [expiry] * count
            self._next_expiry = min(self._next_expiry, expiry)

    def hold(self, lock: int, until: float) -> int | None:
        """Give the lock to the local operator until that time, whatever its lease; returns the former owner."""
        former, self.owners[lock] = self.owners[lock], OPERATOR
        self._change(lock)
        self.follow(lock, 0)
        self.expires[lock] = until
        self._next_expiry = min(self._next_expiry, until)
        return former

    def follow(self, lock: int, connection: int) -> None:
        """The lock follows this connection of its owner from now on."""
        self.connections[lock] = connection
        self.orphans.pop(lock, None)

    def free(self, lock: int) -> int | None:
        """Release unconditionally; returns the former owner."""
        owner, self.owners[lock] = self.owners[lock], None
        self._change(lock)
        self.follow(lock, 0)
        self.expires[lock] = math.inf
        return owner

    def expired(self, now: float) -> list[int]:
        """The owned locks whose lease has ended. Cheap while nothing can have expired."""
        if now < self._next_expiry:
            return []
        ended = [lock for lock, expiry in enumerate(self.expires) if expiry <= now]
        self._next_expiry = min(self.expires, default=math.inf)
        return ended

    def orphaned(self, now: float) -> list[int]:
        """The locks whose owner has not gone on with them in its grace."""
        return sorted(lock for lock, end in self.orphans.items() if end <= now)

    def held_by(self, writer: int) -> list[int]:
        """The locks that `writer` owns."""
        return [lock for lock, owner in enumerate(self.owners) if owner == writer]

    def held_through(self, writer: int, connection: int) -> list[int]:
        """The locks of `writer` that follow this connection; none follows 0."""
        return [lock for lock in self.held_by(writer) if connection and self.connections[lock] == connection]

    def remaining(self, lock: int, now: float) -> float:
        """Seconds of lease left; 0 if free, infinity if owned without a lease."""
        if self.owners[lock] is None:
            return 0.0
        return max(0.0, self.expires[lock] - now)

    def succeed(
        self, former: LockTable, locks: Mapping[int, int], writers: Mapping[int, int], now: float
    ) -> None:
        """Go on with the owners of the former table; the mappings lead from its indices to those here.

        A lease of another length begins anew.
        """
        for source, target in locks.items():
            owner = former.owners[source]
            if owner is None:
                continue
            self.owners[target] = writers[owner]
            self.connections[target] = former.connections[source]
            lease, expires = self.locks[target].lease, former.expires[source]
            if owner == OPERATOR or lease == former.locks[source].lease:
                self.expires[target] = expires
            else:
                self.expires[target] = math.inf if lease is None else now + lease
        self.orphans = {locks[lock]: end for lock, end in former.orphans.items() if lock in locks}
        self._next_expiry = min(self.expires, default=math.inf)

    def _change(self, lock: int) -> None:
        self.changes += 1
        self.tenures[lock] += 1
