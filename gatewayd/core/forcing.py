"""What the local operator holds and forces, and the picture that forced values make on the process image.

A force is an overlay: the truth is kept beside it. Code that is about to change the image calls `lift` first, which
puts the truth back, and `lay` afterwards; between the two nobody looks. A forced output is FORCED whatever the robot
does; a forced input is FORCED while the robot has it, and says what is wrong (stale, unavailable) otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from gatewayd.core.definition import Direction, Value
from gatewayd.core.image import ProcessImage, Quality


@dataclass(frozen=True, slots=True)
class Holder:
    """Who takes and forces as the operator."""

    name: str = ""
    """Of a user of this machine or of a token; empty: not known."""
    credential: str = ""
    """What it acts by from elsewhere, and what it holds ends with; empty: it is on this machine."""

    @property
    def title(self) -> str:
        """`anna`, or `token anna`: a user and a token may have the same name."""
        return f"token {self.name}" if self.credential else self.name


LOCAL = Holder()
"""Somebody on this machine."""


@dataclass(frozen=True, slots=True)
class Force:
    """A value that the local operator put in place of what a variable's source reports."""

    value: Value
    since: float
    until: float
    """Monotonic time at which it ends by itself."""
    holder: Holder = LOCAL


@dataclass(frozen=True, slots=True)
class Hold:
    """A lock that the local operator took."""

    until: float
    """Monotonic time at which it ends by itself; infinity: when it is released."""
    holder: Holder = LOCAL


class Forcing:
    """The forces and the taken locks of one cell; variables and locks are indices."""

    def __init__(self, image: ProcessImage) -> None:
        self._image = image
        self._truth: dict[int, tuple[Value, Quality]] = {}
        """What lies under the overlay, while it is laid."""
        self.forces: dict[int, Force] = {}
        """By variable."""
        self.holds: dict[int, Hold] = {}
        """By lock: those that the operator took."""
        self.next_due = math.inf
        """Nothing ends by itself before this time."""

    def put(self, variable: int, force: Force) -> None:
        """Force a variable; `lay` shows it."""
        self.forces[variable] = force
        self.next_due = min(self.next_due, force.until)

    def hold(self, lock: int, hold: Hold) -> None:
        """Note that the operator took a lock."""
        self.holds[lock] = hold
        self.next_due = min(self.next_due, hold.until)

    def reported(self, variable: int) -> tuple[Value, Quality] | None:
        """What the source of a forced output reports meanwhile. None: it is not forced, or an input.

        What would be written to a forced input is refused: nobody reports it. Its link knows what the robot holds.
        """
        if self._image.variables[variable].direction is Direction.INPUT:
            return None
        return self._truth.get(variable)

    def until(self, lock: int, members: Iterable[int]) -> float | None:
        """How long the operator needs the lock of these variables; None: no longer."""
        ends = [self.forces[member].until for member in members if member in self.forces]
        if lock in self.holds:
            ends.append(self.holds[lock].until)
        return max(ends, default=None)

    def holders(self, lock: int, members: Iterable[int]) -> list[Holder]:
        """For whom the operator has the lock of these variables: who took it, then who forces one of them."""
        found = [self.holds[lock].holder] if lock in self.holds else []
        found += [self.forces[member].holder for member in members if member in self.forces]
        return list(dict.fromkeys(found))

    def of(self, ended: Callable[[Holder], bool]) -> tuple[list[int], list[int]]:
        """The variables that such holders force, and the locks that they took."""
        variables = [variable for variable, force in self.forces.items() if ended(force.holder)]
        return variables, [lock for lock, hold in self.holds.items() if ended(hold.holder)]

    def due(self, now: float) -> tuple[list[int], list[int]]:
        """The variables whose forces and the locks whose holds have ended. Cheap while nothing can have."""
        if now < self.next_due:
            return [], []
        variables = [variable for variable, force in self.forces.items() if force.until <= now]
        locks = [lock for lock, hold in self.holds.items() if hold.until <= now]
        left = [force.until for force in self.forces.values() if force.until > now]
        left += [hold.until for hold in self.holds.values() if hold.until > now]
        self.next_due = min(left, default=math.inf)
        return variables, locks

    def lift(self) -> None:
        """Put the truth back into the image, to be changed. Cheap while nothing is forced."""
        if not self._truth:
            return
        image = self._image
        for index, (value, quality) in self._truth.items():
            image.quality[index] = quality
            if image.variables[index].direction is Direction.OUTPUT:
                image.values[index] = value
        self._truth.clear()

    def lay(self) -> None:
        """Show what is forced, if it is not shown already. Cheap while nothing is forced."""
        if not self.forces or self._truth:
            return
        image = self._image
        for index, force in self.forces.items():
            quality = image.quality[index]
            self._truth[index] = image.values[index], quality
            if image.variables[index].direction is Direction.OUTPUT:
                image.values[index] = force.value
                image.times[index] = force.since
                image.quality[index] = Quality.FORCED
            elif quality in (Quality.GOOD, Quality.OUT_OF_RANGE):
                image.quality[index] = Quality.FORCED
        image.find_unreadable()

    def succeed(self, former: Forcing, variables: Mapping[int, int], locks: Mapping[int, int]) -> None:
        """Go on with all that `former` forces and holds; its overlay is lifted, this one's is laid."""
        self.forces.update({variables[index]: force for index, force in former.forces.items()})
        self.holds.update({locks[lock]: hold for lock, hold in former.holds.items()})
        self.next_due = former.next_due
        self.lay()
