"""What a recording is started and stopped by: nothing, one condition, or one for each. Pure."""

from __future__ import annotations

from typing import NamedTuple

from gatewayd.cli.rtde.conditions import Condition
from gatewayd.cli.rtde.windows import Always, StartStop, Trigger, WhileTrue
from gatewayd.rtde.recipe import Recipe


class Conditions(NamedTuple):
    """What a recording is started and stopped by."""

    during: Condition | None
    start: Condition | None
    stop: Condition | None
    once: bool

    @property
    def fields(self) -> tuple[str, ...]:
        """What has to be subscribed for them."""
        found = (each for each in (self.during, self.start, self.stop) if each is not None)
        return tuple(dict.fromkeys(name for each in found for name in each.fields))

    def trigger(self, recipe: Recipe) -> Trigger:
        """For packages of this recipe."""
        if self.during is not None:
            return WhileTrue(self.during.test(recipe), self.once)
        if self.start is None and self.stop is None:
            return Always()
        start, stop = (None if each is None else each.test(recipe) for each in (self.start, self.stop))
        return StartStop(start, stop)
