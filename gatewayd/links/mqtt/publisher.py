"""Which values are due to be published: on change, by deadband and interval. Pure: time is a parameter.

A change is due `interval` after the last message of its variable at the earliest, and then it is the value of that
moment: what came and went in between is not seen. That a value is good no longer is due at once. Nothing waits in a
queue, so a slow broker gets fewer values, never older ones; what it did not take is due again when it takes something.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from gatewayd.core.definition import Value
from gatewayd.core.image import ProcessImage, Quality
from gatewayd.links.mqtt.plan import Publication

_REACHED: Final = 1 - 1e-9
"""A deadband is decimal, and the difference of two values is not: 0.3 - 0.2 has reached 0.1."""

_EARLY: Final = 0.001
"""Seconds by which a look may come before an interval has passed: the next one would be much later."""


@dataclass(frozen=True, slots=True)
class ValueSample:
    """What a variable was at one moment."""

    name: str
    variable: int
    value: Value | None
    """None: the mapping lets nobody see it now (`on_stale: exception`)."""
    quality: Quality
    time: float
    """When its source had it, monotonic; minus infinity: never."""
    is_first: bool = False
    """It is no change: nothing was said of it yet, or just this."""


@dataclass(slots=True)
class _Said:
    """What was said of a variable last."""

    publication: Publication
    at: float = -math.inf
    value: Value | None = None
    quality: Quality | None = None
    """None: nothing was said yet."""
    is_owed: bool = False
    """Whether the broker did not take it."""


class Publisher:
    """Compares the image with what was said of it."""

    def __init__(self, publications: Sequence[Publication], image: ProcessImage, every: float | None) -> None:
        self._image = image
        self._every = math.inf if every is None else every
        self._said = [_Said(each) for each in publications]
        self._by_variable = {said.publication.variable: said for said in self._said}

    @property
    def pace(self) -> float:
        """Seconds between two looks that miss no interval."""
        return min((each.publication.interval for each in self._said), default=1.0)

    def forget(self) -> None:
        """Nobody knows any more what was said: all of it is due."""
        for said in self._said:
            said.at, said.quality, said.is_owed = -math.inf, None, False

    def succeed(self, former: Publisher) -> None:
        """Go on with what the former one has said under the same names."""
        known = {said.publication.name: said for said in former._said}
        for said in self._said:
            same = known.get(said.publication.name)
            if same is not None:
                said.at, said.value, said.quality = same.at, same.value, same.quality
                said.is_owed = same.is_owed

    def due(self, now: float, *, repeat: bool, owed: bool = False) -> Iterator[ValueSample]:
        """What is to be said now; `said` has to be called for what was.

        `repeat`: also what is said every so often. `owed`: also what the broker did not take when it was due.
        """
        image = self._image
        values, qualities, unreadable = image.values, image.quality, image.unreadable
        for said in self._said:
            publication = said.publication
            since = now - said.at
            index = publication.variable
            quality = qualities[index]
            is_good_no_longer = said.quality is Quality.GOOD and quality is not Quality.GOOD
            if since < publication.interval - _EARLY and not is_good_no_longer:
                continue
            value = None if index in unreadable else values[index]
            differs = self._differs(said, value, quality)
            if differs or (owed and said.is_owed) or (repeat and since >= self._every):
                is_change = differs and said.quality is not None
                yield ValueSample(
                    publication.name, index, value, quality, image.time_of(index), not is_change
                )

    def sample(self, variable: int) -> ValueSample:
        """What a variable is now, whether or not it is due."""
        image = self._image
        value = None if variable in image.unreadable else image.values[variable]
        return ValueSample("", variable, value, image.quality[variable], image.time_of(variable))

    def said(self, sample: ValueSample, now: float, *, taken: bool = True) -> None:
        """A sample was sent; or, where it was not taken, is kept or let go."""
        said = self._by_variable[sample.variable]
        said.is_owed = not taken
        said.at, said.value, said.quality = now, sample.value, sample.quality

    @staticmethod
    def _differs(said: _Said, value: Value | None, quality: Quality) -> bool:
        if quality is not said.quality:
            return True
        old = said.value
        if value is None or old is None:
            return value is not old
        if value == old or (value != value and old != old):  # noqa: PLR0124 - NaN is what NaN is
            return False
        return not abs(value - old) < said.publication.deadband * _REACHED
