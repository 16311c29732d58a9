"""A histogram of durations, cheap enough for every package: one search, three additions, no lock."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from itertools import accumulate

BOUNDS = (
    0.000_05, 0.000_1, 0.000_2, 0.000_3, 0.000_5, 0.001, 0.002, 0.004, 0.008, 0.02, 0.05, 0.1, 0.25, 1.0,
)  # fmt: skip
"""Upper bounds of the buckets in seconds; one more bucket takes the rest."""


class Histogram:
    """Counts durations in seconds by `BOUNDS`, each bound inclusive."""

    __slots__ = ("_counts", "total")

    def __init__(self) -> None:
        self._counts = [0] * (len(BOUNDS) + 1)
        self.total = 0.0
        """Sum of all durations."""

    def observe(self, seconds: float) -> None:
        """Count one duration; one below zero counts as none at all."""
        seconds = max(seconds, 0.0)
        self._counts[bisect_left(BOUNDS, seconds)] += 1
        self.total += seconds

    @property
    def count(self) -> int:
        """Durations seen."""
        return sum(self._counts)

    def buckets(self) -> Iterator[tuple[float, int]]:
        """Each bound with the number of durations up to it; the last bound is infinity."""
        return zip((*BOUNDS, float("inf")), accumulate(self._counts), strict=True)
