"""From a device into the robot's inputs: the device is a writer of the cell like any other.

Each answer writes what it brought, though nothing changed: that renews what the device owns and keeps its values young.
A lock is written whole, with all values that the device has for it, so a group waits for the first of each. Locks are
independent of each other: what one value of an answer meets does not hold the others up.

| what stands in the way | what becomes of the value |
|---|---|
| another writer holds it, and ranks higher | asked for once for each new value, so that the refusal is seen; \
written as soon as the lock is free |
| outside its limits, or nothing that the robot's type has | refused once for each new value, and the lock is \
released: a device cannot be told, so its last good value must not stay in force |
| the robot is away | not asked for; a lock with a lease that the device owns is renewed |
| it was not read for `lost_after` | its lock is released |
| the device is lost | its writer is lost, and with it all that it owns |
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value
from gatewayd.core.limits import within
from gatewayd.core.ownership import Standing
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester, new_connection

_WRITABLE: Final = (Standing.OWNER, Standing.FREE, Standing.HIGHER)
"""How the device stands to a lock that it may write."""


class Inflow:
    """Writes what a device says. `variables`: all inputs that it has; `writer`: what it is in the cell, if anything."""

    def __init__(
        self, cell: Cell, writer: int | None, peer: str, variables: Iterable[int], lost_after: float
    ) -> None:
        self.requester = Requester(writer, peer, new_connection())
        self.connected = False
        self.lost_after = lost_after
        self._bind(cell, variables)

    def _bind(self, cell: Cell, variables: Iterable[int]) -> None:
        self._cell = cell
        self._latest: dict[int, Value | None] = {}
        """The newest value of each variable, while it is young enough."""
        self._times: dict[int, float] = {}
        self._refused: dict[int, tuple[Reason, tuple[Value | None, ...]]] = {}
        """Why a lock was not written last, and the values that were not."""
        self._locks: dict[int, int] = {}
        self._members: dict[int, list[int]] = {}
        for index in dict.fromkeys(variables):
            lock = cell.definition.variables[index].lock
            if lock is not None:
                self._locks[index] = lock
                self._members.setdefault(lock, []).append(index)

    def gap(self, length: float) -> None:
        """The process stood still: nothing could be read meanwhile, and what is read now may have waited."""
        self._times = {index: time + length for index, time in self._times.items()}
        self.requester = replace(self.requester, waited=length)

    def caught_up(self) -> None:
        """What waited has been read."""
        if self.requester.waited:
            self.requester = replace(self.requester, waited=0.0)

    @property
    def lacking(self) -> list[int]:
        """Variables of which there is no young value."""
        return [index for index in self._locks if index not in self._latest]

    def rebind(self, cell: Cell, writer: int | None, variables: Mapping[int, int]) -> None:
        """Go on in the successor of the cell; `variables`: its indices there by those here."""
        latest, times = self._latest, self._times
        self.requester = replace(self.requester, writer=writer)
        self._bind(cell, variables.values())
        self._latest = {variables[index]: value for index, value in latest.items() if index in variables}
        self._times = {variables[index]: time for index, time in times.items() if index in variables}

    def connect(self, now: float) -> None:
        """The device answers."""
        if not self.connected:
            self.connected = True
            self._cell.writer_connected(self.requester, now, "the device answers")

    def lose(self, reason: str, now: float) -> None:
        """The device does not answer any more, or is given up: nothing that it said counts."""
        self._latest.clear()
        self._times.clear()
        self._refused.clear()
        if self.connected:
            self.connected = False
            self._cell.writer_disconnected(self.requester, now, reason, at_once=True)

    def receive(self, values: Iterable[tuple[int, Value | None]], now: float) -> None:
        """The device has answered; None: what it has is no value of the robot's type."""
        touched: dict[int, None] = {}
        for index, value in values:
            if index in self._locks:
                self._latest[index], self._times[index] = value, now
                touched[self._locks[index]] = None
        self.connect(now)
        self._cell.writer_seen(self.requester, now)
        if self.requester.writer is not None:
            self._write(touched, now)

    def expire(self, now: float) -> list[int]:
        """Release what was not read for too long; returns these variables."""
        old = [index for index, time in self._times.items() if now - time > self.lost_after]
        for index in old:
            del self._latest[index], self._times[index]
        for lock in dict.fromkeys(self._locks[index] for index in old):
            self._refused.pop(lock, None)
            self._release(lock, now)
        return old

    # -- inside --------------------------------------------------------------------------------------------------

    def _write(self, locks: Iterable[int], now: float) -> None:
        """In one request, or where that is refused in one for each lock."""
        free = [lock for lock in locks if self._is_free(lock, now)]
        if not free or self._cell.write(self.requester, self._changes(free), now) is None:
            return
        if len(free) > 1:
            for lock in free:
                self._cell.write(self.requester, self._changes((lock,)), now)

    def _is_free(self, lock: int, now: float) -> bool:
        """Whether nothing stands in the way; what does is reported once for each new value."""
        members = self._members[lock]
        if any(index not in self._latest for index in members):
            return False
        standing = self._standing(lock)
        if not self._cell.accepts_writes:
            return standing is Standing.OWNER and self._cell.ownership.locks[lock].lease is not None
        reason = self._obstacle(members, standing)
        if reason is None:
            self._refused.pop(lock, None)
            return True
        said = reason, tuple(self._latest[index] for index in members if not _is_nan(self._latest[index]))
        if self._refused.get(lock) != said:
            self._refused[lock] = said
            self._refuse(lock, reason, now)
        return False

    def _obstacle(self, members: Sequence[int], standing: Standing) -> Reason | None:
        cell = self._cell
        for index in members:
            value = self._latest[index]
            if value is None or within(cell.definition.variables[index], value) is None:
                return Reason.OUT_OF_LIMITS
        if not all(cell.image.available[index] for index in members):
            return Reason.CLAIMED_ELSEWHERE
        return None if standing in _WRITABLE else Reason.HELD

    def _refuse(self, lock: int, reason: Reason, now: float) -> None:
        """Have the refusal counted and recorded, and leave no older value of the device in force behind it."""
        changes = self._changes((lock,))
        if len(changes) == len(self._members[lock]):
            self._cell.write(self.requester, changes, now)
        else:
            nothing = next(index for index in self._members[lock] if self._latest[index] is None)
            self._cell.refuse(self.requester, Refusal(reason, nothing, hint="it says no number"), now)
        if reason is Reason.OUT_OF_LIMITS:
            self._release(lock, now)

    def _release(self, lock: int, now: float) -> None:
        if self._standing(lock) is Standing.OWNER:
            self._cell.release(self.requester, self._members[lock][0], now)

    def _standing(self, lock: int) -> Standing:
        writer = self.requester.writer
        return Standing.EXCLUDED if writer is None else self._cell.ownership.standing(lock, writer)

    def _changes(self, locks: Iterable[int]) -> list[Change]:
        return [
            Change(index, value)
            for lock in locks
            for index in self._members[lock]
            if (value := self._latest[index]) is not None
        ]


def _is_nan(value: Value | None) -> bool:
    return value is not None and value != value  # noqa: PLR0124
