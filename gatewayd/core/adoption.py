"""For how long inputs keep what the robot held before the gateway came, while nobody owns them.

Counted once per process, from the moment at which somebody could claim them: the inputs are adopted and the cell can be
reached. Neither a session that flaps nor a reload begins it anew. Once it is over it stays so: what a later session
adopts without an owner falls back at once.
"""

from __future__ import annotations

import math
from enum import Enum

__all__ = ["Adoption", "Step"]


class Step(Enum):
    """What a look at the clock brought."""

    NOTHING = "nothing"
    BEGIN = "the count begins"
    END = "the count ends"


class Adoption:
    """The count of one cell; `adopt_for` in seconds, None: adopted values stay."""

    __slots__ = ("adopt_for", "began", "over", "reachable")

    def __init__(self, adopt_for: float | None) -> None:
        self.adopt_for = adopt_for
        self.reachable = False
        """Whether a writer could have reached the cell since the start: a listener listens, or the node is on its bus."""
        self.began = math.inf
        """When the count began."""
        self.over = False
        """Whether it has ended: inputs are adopted for owners alone."""

    def look(self, now: float, *, adopted: bool) -> Step:
        """Notice that the count begins or ends; `adopted`: the robot is there and its inputs were taken over."""
        if self.over or self.adopt_for is None:
            return Step.NOTHING
        if math.isinf(self.began):
            if not (adopted and self.reachable):
                return Step.NOTHING
            self.began = now
            return Step.BEGIN
        if now - self.began < self.adopt_for:
            return Step.NOTHING
        self.over = True
        return Step.END

    def left(self, now: float) -> float:
        """Seconds until it ends; 0 while it does not run."""
        if self.over or self.adopt_for is None or math.isinf(self.began):
            return 0.0
        return max(0.0, self.began + self.adopt_for - now)

    def succeed(self, former: Adoption) -> None:
        """Go on where `former` stands."""
        self.reachable, self.began, self.over = former.reachable, former.began, former.over
