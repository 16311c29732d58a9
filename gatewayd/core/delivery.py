"""What of the inputs was given to the robot in the present session, and what became of it.

An input is *given* when it is written, forced, or falls back; one that was only adopted follows the robot. A release
is done when its fallback has reached the robot, not when it stands in the image: until the link says so (`delivered`)
it is under way, and if the session ends before, it is owed to the next one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping

from gatewayd.core.definition import Value
from gatewayd.core.events import Event, EventKind
from gatewayd.core.health import Health
from gatewayd.core.image import ProcessImage, Quality
from gatewayd.core.refusal_log import REFUSAL_INTERVAL


class Delivery:
    """The inputs of one cell by variable index. It brings the health figures about them up to date."""

    def __init__(self, image: ProcessImage, health: Health, record: Callable[[Event], None]) -> None:
        self._image = image
        self._health = health
        self._record = record
        self.ready = False
        """Whether the robot is connected and its inputs were adopted."""
        self.given_at: list[float] = [-math.inf] * len(image.variables)
        """When each input was last given in this session; minus infinity if it was not."""
        self.owed: set[int] = set()
        """Inputs to fall back at the next adoption: robot or register was not there, or the session ended too early."""
        self.under_way: set[int] = set()
        """Inputs whose fallback was applied and is not known to have reached the robot."""
        self.differing: set[int] = set()
        """Given inputs for which the robot holds something else."""
        self.unread: set[int] = set()
        """Available inputs of this session that were neither adopted nor given."""
        self._seen: set[int] = set()
        self._new: list[tuple[int, Value]] = []
        self._reported: dict[tuple[EventKind, int], float] = {}

    def is_given(self, index: int) -> bool:
        """Whether the input was written, forced or given its fallback in this session."""
        return self.given_at[index] > -math.inf

    # -- what goes out -------------------------------------------------------------------------------------------

    def give(self, values: Iterable[tuple[int, Value]], now: float) -> None:
        """Inputs were written or forced; the image holds them already. What was due of them is not any more."""
        given_at = self.given_at
        indices = [index for index, _value in values]
        for index in indices:
            given_at[index] = now
        self.given(indices)

    def given(self, indices: Iterable[int]) -> None:
        """The same of inputs whose time in `given_at` is set already."""
        if self.owed:
            self.owed.difference_update(indices)
        if self.under_way:
            self.under_way.difference_update(indices)
        if self.unread:
            self._read(indices)
        if self.differing:
            self._mark(self.differing.intersection(indices))

    def release(self, index: int, value: Value, now: float) -> None:
        """An input was given its release fallback; the image holds it already."""
        self.give(((index, value),), now)
        self.under_way.add(index)
        self._new.append((index, value))

    def take_releases(self) -> list[tuple[int, Value]]:
        """The fallbacks since the last call, in their order; for the link, which has them act."""
        new, self._new = self._new, []
        return new

    def delivered(self, index: int) -> None:
        """The fallback of an input has reached the robot."""
        self.under_way.discard(index)

    # -- the session ---------------------------------------------------------------------------------------------

    def adopted(self, values: Collection[int]) -> set[int]:
        """What these inputs hold was read; returns the inputs that are in the session since this adoption."""
        self.ready = True
        image = self._image
        present = {index for index in image.inputs if image.available[index]}
        entered = present - self._seen
        self._seen |= entered
        self.unread |= {index for index in entered if not self.is_given(index)}
        self._read(values)
        return entered

    def leave(self, index: int) -> None:
        """The controller no longer gives us the register of an input."""
        self._seen.discard(index)
        self._forget((index,))

    def lost(self) -> None:
        """The session has ended. What was under way is owed to the next one; what the robot holds is not known."""
        self.ready = False
        self._seen.clear()
        self._forget(self._image.inputs)

    # -- what the robot holds ------------------------------------------------------------------------------------

    def differ(self, held: Mapping[int, str], now: float) -> None:
        """Given inputs read back otherwise for too long; the texts say how."""
        new = {index: text for index, text in held.items() if index not in self.differing}
        self.differing |= new.keys()
        self._mark(new)
        self._health.read_back_mismatches += len(new)
        self._health.differing = len(self.differing)
        for index, text in new.items():
            self._report(Event(now, EventKind.READ_BACK_DIFFERS, variable=index, detail=text))

    def agree(self, indices: Iterable[int]) -> None:
        """Inputs read back as they were given."""
        quality = self._image.quality
        for index in self.differing.intersection(indices):
            self.differing.discard(index)
            if quality[index] is Quality.DIFFERS:
                quality[index] = self._image.judged(index)
        self._health.differing = len(self.differing)

    def follow(self, held: Mapping[int, Value], now: float) -> None:
        """Inputs that nobody gave hold something else now: the image shows it."""
        for index, value in held.items():
            old = self._image.values[index]
            self._report(Event(now, EventKind.FOLLOWED, variable=index, old=old, new=value))
        self._image.store_all(held.items(), now)

    def succeed(
        self,
        former: Delivery,
        health: Health,
        variables: Mapping[int, int],
        places: Callable[[set[int]], Iterable[int]],
    ) -> None:
        """Go on where `former` stands; `variables`: old -> new index, `places`: the same by what is in a register."""
        self._health = health
        self.ready = former.ready
        for source, target in variables.items():
            self.given_at[target] = former.given_at[source]
        self.owed = set(places(former.owed))
        self.under_way = set(places(former.under_way))
        self.differing = {variables[index] for index in former.differing if index in variables}
        self.unread = {variables[index] for index in former.unread if index in variables}
        self._seen = {variables[index] for index in former._seen if index in variables}
        self._reported = {
            (kind, variables[index]): time
            for (kind, index), time in former._reported.items()
            if index in variables
        }
        health.differing, health.unadopted = len(self.differing), len(self.unread)

    # -- inside --------------------------------------------------------------------------------------------------

    def _forget(self, indices: Iterable[int]) -> None:
        gone = set(indices)
        self.agree(gone)
        for index in gone:
            self.given_at[index] = -math.inf
        self.owed |= self.under_way & gone
        self.under_way -= gone
        self._new = [release for release in self._new if release[0] not in gone]
        self._read(gone)

    def _read(self, indices: Iterable[int]) -> None:
        self.unread.difference_update(indices)
        self._health.unadopted = len(self.unread)

    def _mark(self, indices: Iterable[int]) -> None:
        quality = self._image.quality
        for index in indices:
            if quality[index] in (Quality.GOOD, Quality.OUT_OF_RANGE):
                quality[index] = Quality.DIFFERS

    def _report(self, event: Event) -> None:
        """At most one event of a kind for a variable in each `REFUSAL_INTERVAL`: two masters may fight for it."""
        assert event.variable is not None
        key = event.kind, event.variable
        if event.time - self._reported.get(key, -math.inf) >= REFUSAL_INTERVAL:
            self._reported[key] = event.time
            self._record(event)
