"""What happened, bounded so that what is frequent never drives out what is rare."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from heapq import merge
from itertools import islice, takewhile
from typing import Generic, TypeVar

OF_KIND = 100
"""Former entries of each kind that are kept beside the last ones of all kinds."""
SPACED = 100
"""Still older ones of each kind, `SPACING` seconds apart."""
SPACING = 60.0
"""Seconds: of what happens all the time one entry for each minute is kept, for as many minutes as `SPACED` says."""

_Entry = TypeVar("_Entry")
_Numbered = tuple[int, float, _Entry]
"""Number, time, entry."""


@dataclass(slots=True)
class _Former(Generic[_Entry]):
    """Entries of one kind that are no longer among the last ones of all."""

    recent: deque[_Numbered[_Entry]] = field(default_factory=deque)
    spaced: deque[_Numbered[_Entry]] = field(default_factory=lambda: deque(maxlen=SPACED))

    def add(self, entry: _Numbered[_Entry]) -> None:
        self.recent.append(entry)
        if len(self.recent) > OF_KIND:
            oldest = self.recent.popleft()
            if not self.spaced or oldest[1] - self.spaced[-1][1] >= SPACING:
                self.spaced.append(oldest)


class History(Generic[_Entry]):
    """The last `capacity` entries, and of each kind `OF_KIND` more and `SPACED` spaced ones. Numbers begin with 1."""

    def __init__(self, capacity: int) -> None:
        self.count = 0
        """Entries since the start, the forgotten ones included: the number of the last one."""
        self._capacity = capacity
        self._last: deque[tuple[Hashable, _Numbered[_Entry]]] = deque()
        self._former: dict[Hashable, _Former[_Entry]] = {}

    def append(self, kind: Hashable, time: float, entry: _Entry) -> None:
        """Keep the entry. There must be few kinds, as few as a table has."""
        self.count += 1
        self._last.append((kind, (self.count, time, entry)))
        if len(self._last) > self._capacity:
            former_kind, former = self._last.popleft()
            self._former.setdefault(former_kind, _Former()).add(former)

    def since(self, number: int, most: int | None = None) -> list[tuple[int, _Entry]]:
        """Entries with greater numbers, `most` of them at most: the last ones, in their order. What is recent is quick.

        Numbers that are missing between others were forgotten.
        """
        newest = islice(reversed(self._last), most)
        last = [entry for _, entry in takewhile(lambda kept: kept[1][0] > number, newest)]
        last.reverse()
        if len(last) == len(self._last) and len(last) != most:
            older = [entry for entry in self._older() if entry[0] > number]
            last = [*(older if most is None else older[max(0, len(older) + len(last) - most) :]), *last]
        return [(its, entry) for its, _, entry in last]

    def succeed(self, former: History[_Entry], change: Callable[[_Entry], _Entry]) -> None:
        """Go on with the entries of `former` and their numbers, each as `change` makes it."""

        def changed(rows: deque[_Numbered[_Entry]]) -> deque[_Numbered[_Entry]]:
            return deque(((number, time, change(entry)) for number, time, entry in rows), rows.maxlen)

        self.count = former.count
        self._last = deque(
            (kind, (number, time, change(entry))) for kind, (number, time, entry) in former._last
        )
        self._former = {
            kind: _Former(changed(its.recent), changed(its.spaced)) for kind, its in former._former.items()
        }

    def __iter__(self) -> Iterator[_Entry]:
        return (entry for _, entry in self.since(0))

    def __len__(self) -> int:
        former = self._former.values()
        return len(self._last) + sum(len(of_kind.recent) + len(of_kind.spaced) for of_kind in former)

    def _older(self) -> Iterator[_Numbered[_Entry]]:
        rows = (row for of_kind in self._former.values() for row in (of_kind.spaced, of_kind.recent))
        return merge(*rows, key=lambda entry: entry[0])
