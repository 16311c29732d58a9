"""Release fallbacks: which inputs take theirs, and that they do."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from gatewayd.core.adoption import would_fall_back
from gatewayd.core.definition import CellDefinition, FallbackKind
from gatewayd.core.delivery import Delivery
from gatewayd.core.events import Event, EventKind
from gatewayd.core.image import ProcessImage
from gatewayd.core.ownership import LockTable

_NOT_READABLE = "the robot does not say what it holds"


@dataclass(slots=True, eq=False)
class Fallbacks:
    """The fallbacks of one cell's inputs. The caller says afterwards that inputs have changed."""

    _definition: CellDefinition
    _image: ProcessImage
    _ownership: LockTable
    _delivery: Delivery
    _record: Callable[[Event], None]

    def apply(self, variables: Iterable[int], now: float) -> None:
        """Give these inputs their fallbacks; without the robot or the register they are owed."""
        image, delivery = self._image, self._delivery
        for index in variables:
            variable = self._definition.variables[index]
            if variable.is_command:
                self._rest(index, now)
                continue
            if not (delivery.ready and image.available[index]):
                delivery.owed.add(index)
                continue
            delivery.owed.discard(index)
            if variable.on_release.kind is FallbackKind.HOLD:
                continue
            old = image.values[index]
            new = variable.on_release.apply(old, variable.kind)
            image.store(index, new, now)
            delivery.release(index, new, now)
            if new != old:
                self._record(Event(now, EventKind.FALLBACK, variable=index, old=old, new=new))

    def complete(self, variables: Iterable[int], now: float) -> None:
        """Inputs that go out with one that was written, and of which nobody knows what the robot holds, fall back.

        Where their policy is to hold there is nothing to be held: they become zero.
        """
        for index in variables:
            variable = self._definition.variables[index]
            value = variable.on_release.apply(variable.kind.zero, variable.kind)
            self._image.store(index, value, now)
            self._delivery.give(((index, value),), now)
            self._record(Event(now, EventKind.FALLBACK, variable=index, new=value, detail=_NOT_READABLE))

    def due(self, entered: Iterable[int], *, over: bool) -> list[int]:
        """What falls back when it is adopted: what is owed, and of those who `entered` what the policies say.

        `over`: the time is over for which adopted inputs keep their values without an owner.
        """
        wanted = self._delivery.owed.copy()
        if self._definition.clear_on_connect:
            wanted.update(filter(self._is_ownerless, entered))
        elif over:
            wanted.update(self.of_nobody(entered))
        return sorted(wanted)

    def of_nobody(self, variables: Iterable[int]) -> Iterator[int]:
        """Those that nobody owns and for which a fallback would change something."""
        return would_fall_back(self._image, filter(self._is_ownerless, variables), self._delivery.unread)

    def inherited(self, lock: int, writer: int) -> list[int]:
        """The members of a free group whose values are not from this session: adopted, or not even read.

        Another writer may have left them, unless nobody but `writer` can own the lock. A variable that is guarded alone
        is no command that is composed of what two writers meant: a writer that claims it may keep it.
        """
        declared = self._ownership.locks[lock]
        if len(declared.members) == 1 or declared.owners == (writer,):
            return []
        return [index for index in declared.members if not self._delivery.is_given(index)]

    def _rest(self, index: int, now: float) -> None:
        """A command comes to rest. The robot gets nothing of that, so nothing is owed or under way."""
        old, new = self._image.values[index], self._definition.variables[index].kind.zero
        if old != new:
            self._image.store(index, new, now)
            self._record(Event(now, EventKind.FALLBACK, variable=index, old=old, new=new))

    def _is_ownerless(self, index: int) -> bool:
        lock = self._definition.variables[index].lock
        return lock is not None and self._ownership.owners[lock] is None and self._image.available[index]
