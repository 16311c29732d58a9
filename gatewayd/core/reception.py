"""The packages of the robot as they come: which are shown, how late they are, and when the outputs are stale."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from gatewayd.core.events import Event, EventKind
from gatewayd.core.forcing import Forcing
from gatewayd.core.freshness import Freshness, Source
from gatewayd.core.health import Health
from gatewayd.core.image import ProcessImage
from gatewayd.core.lag import Lag


@dataclass(slots=True, eq=False)
class Reception:
    """Decides of each package of one cell."""

    health: Health
    """Exchanged when the cell takes another one's place."""
    _freshness: Freshness
    _lag: Lag
    _image: ProcessImage
    _forcing: Forcing
    _record: Callable[[Event], None]
    _notify: Callable[[], None]
    """Says that outputs have changed."""

    def package(self, timestamp: float | None, now: float, raw: float) -> bool:
        """Whether the package is to be shown: not if it reports nothing new, or comes too late."""
        if self._freshness.state is Source.LOST:
            return False
        self.health.packages += 1
        was_fresh = self._freshness.state is Source.FRESH
        shown = self._freshness.package(timestamp, now, self._measure_lag(timestamp, raw))
        if shown:
            if not was_fresh:
                self._lag.in_time()
                self._record(Event(now, EventKind.FRESH))
            self._forcing.lift()
            self._image.uncover()
        elif self._freshness.state is Source.LATE:
            self._lag.stays_late(now)
            if was_fresh:
                self._stale(now)
        return shown

    def doubtful(self, now: float) -> bool:
        """Whether packages stay late, and it is time to ask the controller for the reason."""
        return self._freshness.state is Source.LATE and self._lag.doubtful(now)

    def probed(self, delay: float) -> bool:
        """Whether the controller answers after `delay` seconds, so quickly that nothing of what it sent is queued."""
        if self._freshness.state is not Source.LATE or not self._lag.probed(delay):
            return False
        self.health.lag = self._lag.seconds
        self._lag.in_time()
        return True

    def tick(self, now: float) -> None:
        """Notice that no package came, or none that reports anything."""
        was_fresh = self._freshness.state is Source.FRESH
        self._freshness.tick(now)
        if was_fresh and self._freshness.state is not Source.FRESH:
            self._stale(now)

    def lost(self) -> None:
        """What the robot reported until now is stale."""
        self._forcing.lift()
        self._image.outputs_lost()
        self._notify()

    def _stale(self, now: float) -> None:
        """The robot is connected and was fresh until now."""
        self._record(Event(now, EventKind.STALE, detail=self._freshness.state.name.lower()))
        self.lost()

    def _measure_lag(self, timestamp: float | None, raw: float) -> float:
        if timestamp is None or not math.isfinite(timestamp):
            return 0.0
        self.health.lag = self._lag.package(timestamp, raw)
        return self.health.lag
