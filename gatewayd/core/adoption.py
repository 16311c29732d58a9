"""For how long inputs keep what the robot held before the gateway came, while nobody owns them.

Counted once per process, from the moment at which somebody could claim them: the inputs are adopted and the cell can be
reached. Neither a session that flaps nor a reload begins it anew. Once it is over it stays so: what a later session
adopts without an owner falls back at once.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from enum import Enum

from gatewayd.core.definition import FallbackKind
from gatewayd.core.image import ProcessImage

_NAMED = 8
"""Variables that an event names one by one."""


class AdoptionStep(Enum):
    """What a look at the clock brought."""

    NOTHING = "nothing"
    BEGIN = "the count begins"
    END = "the count ends"


class Adoption:
    """The count of one cell; `adopt_for` in seconds, None: adopted values stay."""

    def __init__(self, adopt_for: float | None) -> None:
        self.adopt_for = adopt_for
        self.reachable = False
        """Whether a writer could have reached the cell since the start: a listener, or the node on its bus."""
        self.began = math.inf
        """When the count began."""
        self.over = False
        """Whether it has ended: inputs are adopted for owners alone."""

    def look(self, now: float, *, adopted: bool) -> AdoptionStep:
        """Notice that the count begins or ends; `adopted`: the robot is there and its inputs were taken over."""
        if self.over or self.adopt_for is None:
            return AdoptionStep.NOTHING
        if math.isinf(self.began):
            if not (adopted and self.reachable):
                return AdoptionStep.NOTHING
            self.began = now
            return AdoptionStep.BEGIN
        if now - self.began < self.adopt_for:
            return AdoptionStep.NOTHING
        self.over = True
        return AdoptionStep.END

    def left(self, now: float) -> float:
        """Seconds until it ends; 0 while it does not run."""
        if self.over or self.adopt_for is None or math.isinf(self.began):
            return 0.0
        return max(0.0, self.began + self.adopt_for - now)

    def succeed(self, former: Adoption) -> None:
        """Go on where `former` stands."""
        self.reachable, self.began, self.over = former.reachable, former.began, former.over


def would_fall_back(image: ProcessImage, inputs: Iterable[int], unread: Collection[int]) -> Iterator[int]:
    """Those whose release fallback would change something, as far as it is known what the robot holds."""
    for index in inputs:
        variable, value = image.variables[index], image.values[index]
        fallback = variable.on_release
        if fallback.kind is not FallbackKind.HOLD and (
            index in unread or fallback.apply(value, variable.kind) != value
        ):
            yield index


def named(image: ProcessImage, inputs: Sequence[int]) -> str:
    """Their names, as far as an event has room for them: `a, b and 3 more`."""
    names = ", ".join(image.variables[index].name for index in inputs[:_NAMED])
    return f"{names} and {len(inputs) - _NAMED} more" if len(inputs) > _NAMED else names


def adopted(image: ProcessImage, count: int, unread: Collection[int]) -> str:
    """What an adoption came to: `58 variables; not readable: a, b and 3 more`."""
    counted = f"{count or 'no'} {'variable' if count == 1 else 'variables'}"
    return counted + (f"; not readable: {named(image, sorted(unread))}" if unread else "")
