"""The local operator: takes and frees locks, and puts values in place of what their sources report.

He stands above every writer: what he takes nobody else gets, whatever lease or priority the mapping declares. Several
people may act as the operator, each with a `Holder`: none of them is kept from what another one took or forced, but
what each holds is known, and ends with what it acts by.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from gatewayd.core.admission import Admission, Change
from gatewayd.core.definition import OPERATOR, Direction, Value
from gatewayd.core.delivery import Delivery
from gatewayd.core.events import Event, EventKind
from gatewayd.core.fallbacks import Fallbacks
from gatewayd.core.forcing import LOCAL, Force, Forcing, Hold, Holder
from gatewayd.core.image import ProcessImage
from gatewayd.core.limits import within
from gatewayd.core.locking import Locking
from gatewayd.core.ownership import LockTable
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import LOCAL_OPERATOR, Requester

_ACTS_NOT = "a command acts only when its owner writes it"


@dataclass(slots=True, eq=False)
class Operator:
    """Carries out what the local operator of one cell asks for; `forcing` is what he holds and forces."""

    _image: ProcessImage
    _ownership: LockTable
    forcing: Forcing
    _admission: Admission
    _locking: Locking
    _fallbacks: Fallbacks
    _delivery: Delivery
    _record: Callable[[Event], None]
    _refuse: Callable[[Requester, Refusal, float, Value], None]
    _notify: Callable[[Direction], None]

    def take_lock(
        self, lock: int, now: float, until: float = math.inf, detail: str = "", holder: Holder = LOCAL
    ) -> None:
        """The local operator takes a lock from its owner; nobody else gets it until `until` or `free_lock`.

        Taken from a writer, all its members take their release fallback, as with any takeover; of a free group
        those do that were only adopted. Taking it again changes `until` and the holder.
        """
        self.release_expired(now)
        former = self.forcing.holds.get(lock)
        self.forcing.hold(lock, Hold(until, holder))
        if former is not None and former.holder != holder:
            passed = ", ".join(
                filter(None, (detail, f"held by {former.holder.title or 'this machine'} before"))
            )
            self._record(
                Event(now, EventKind.TAKEN_OVER, lock=lock, writer=OPERATOR, other=OPERATOR, detail=passed)
            )
        if self._hold(lock, now, detail):
            self._notify(Direction.INPUT)

    def free_lock(self, lock: int, now: float, detail: str = "") -> bool:
        """The local operator releases a lock of any owner; release fallbacks apply. Whether there was an owner."""
        self.release_expired(now)
        owner = self._ownership.owners[lock]
        if owner is None:
            return False
        by = f"released by the local operator{detail and f' ({detail})'}"
        if owner == OPERATOR:
            members = self._ownership.locks[lock].members
            self.end([member for member in members if member in self.forcing.forces], [lock], now, by)
        else:
            self._locking.free([lock], now, by)
        return True

    def force(  # noqa: PLR0917 - what, until when, and by whom
        self,
        variable: int,
        value: Value,
        now: float,
        until: float,
        detail: str = "",
        holder: Holder = LOCAL,
    ) -> Refusal | None:
        """The local operator puts `value` in place of what the variable's source reports, at the latest until `until`.

        The robot gets a forced input as the operator's, who holds its lock so long; the fieldbus sees a forced output.
        The other members of its lock take their release fallback, as `take_lock` says. Commands cannot be forced.
        Forcing it again changes value, `until` and holder. Refused like any write: limits, robot, register.
        """
        self.release_expired(now)
        declared = self._image.variables[variable]
        lock = declared.lock
        is_input = declared.direction is Direction.INPUT
        refusal: Refusal | None = None
        if declared.is_command:
            allowed, refusal = None, Refusal(Reason.NOT_WRITABLE, variable, hint=_ACTS_NOT)
        elif is_input:
            verdict = self._admission.judge(
                LOCAL_OPERATOR, [Change(variable, value)], adopted=self._delivery.ready
            )
            allowed, refusal = dict(verdict.values).get(variable), verdict.refusal
        else:
            allowed = within(declared, value)
        if allowed is None:
            refusal = refusal or Refusal(Reason.OUT_OF_LIMITS, variable)
            self._refuse(LOCAL_OPERATOR, refusal, now, value)
            return refusal
        old = self._image.values[variable]
        self.forcing.lift()
        self.forcing.put(variable, Force(allowed, now, until, holder))
        if lock is not None:
            self._hold(lock, now, detail, forced=variable)
        event = Event(now, EventKind.FORCED, variable, lock, OPERATOR, old=old, new=allowed, detail=detail)
        self._record(event)
        if is_input:
            self._give(variable, allowed, now)
            self._notify(Direction.INPUT)
        self._notify(Direction.OUTPUT)
        return None

    def unforce(self, variable: int, now: float, detail: str = "") -> bool:
        """End a force: an output shows the truth again, an input's release fallback applies. Whether there was one."""
        self.release_expired(now)
        if variable not in self.forcing.forces:
            return False
        self._end_forces([variable], now, f"ended by the local operator{detail and f' ({detail})'}")
        return True

    def end(self, variables: Iterable[int], locks: Sequence[int], now: float, detail: str) -> None:
        """End these forces and release these locks of any owner; release fallbacks apply."""
        for lock in locks:
            self.forcing.holds.pop(lock, None)
        self._end_forces(list(variables), now, detail)
        self._locking.free([lock for lock in locks if self._ownership.owners[lock] is not None], now, detail)

    def release_expired(self, now: float) -> None:
        """End what time has ended: forces, what the operator took, and leases."""
        self._end_each(*self.forcing.due(now), now, "time limit")
        self._locking.expire(now)

    def end_of(self, ended: Callable[[Holder], bool], now: float, detail: str) -> bool:
        """End what these holders took and force, and nothing that another one needs. Whether there was anything."""
        self.release_expired(now)
        return self._end_each(*self.forcing.of(ended), now, detail)

    def give_forced(self, now: float) -> None:
        """The robot gets what is forced, whatever its inputs held when they were adopted."""
        for index, force in self.forcing.forces.items():
            is_input = self._image.variables[index].direction is Direction.INPUT
            if is_input and self._image.available[index]:
                self._give(index, force.value, now)

    # -- inside --------------------------------------------------------------------------------------------------

    def _end_each(self, forces: Sequence[int], holds: Sequence[int], now: float, detail: str) -> bool:
        if not forces and not holds:
            return False
        for lock in holds:
            del self.forcing.holds[lock]
        self._end_forces(forces, now, detail)
        self._settle(holds, now, detail)
        return True

    def _give(self, variable: int, value: Value, now: float) -> None:
        self._image.store(variable, value, now)
        self._delivery.give(((variable, value),), now)

    def _hold(self, lock: int, now: float, detail: str, forced: int | None = None) -> bool:
        """The operator holds the lock for as long as its takes and forces last; `forced` is about to be given.

        Its other members fall back if it was a writer's, else those that were only adopted. Whether any had to.
        """
        members = self._ownership.locks[lock].members
        until = self.forcing.until(lock, members)
        assert until is not None
        former = self._ownership.hold(lock, until)
        if former == OPERATOR:
            return False
        kind = EventKind.ACQUIRED if former is None else EventKind.TAKEN_OVER
        self._record(Event(now, kind, lock=lock, writer=OPERATOR, other=former, detail=detail))
        dropped = self._fallbacks.inherited(lock, OPERATOR) if former is None else members
        self._fallbacks.apply([member for member in dropped if member != forced], now)
        return bool(dropped)

    def _end_forces(self, variables: Sequence[int], now: float, detail: str) -> None:
        self.forcing.lift()
        for index in variables:
            old = self.forcing.forces.pop(index).value
            self._record(Event(now, EventKind.UNFORCED, index, writer=OPERATOR, old=old, detail=detail))
        locks = {index: self._image.variables[index].lock for index in variables}
        self._fallbacks.apply([index for index, lock in locks.items() if lock is not None], now)
        self._settle({lock for lock in locks.values() if lock is not None}, now, detail)
        self._image.find_unreadable()
        self._notify(Direction.INPUT)
        self._notify(Direction.OUTPUT)

    def _settle(self, locks: Iterable[int], now: float, detail: str) -> None:
        """Release the locks that the operator no longer needs."""
        for lock in sorted(locks):
            until = self.forcing.until(lock, self._ownership.locks[lock].members)
            if until is not None:
                self._ownership.hold(lock, until)
            elif self._ownership.owners[lock] == OPERATOR:
                self._locking.free([lock], now, detail)
