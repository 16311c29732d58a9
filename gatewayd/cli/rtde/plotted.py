"""The values of a recording that are drawn, and where their curves are interrupted. Pure."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from gatewayd.cli.rtde.panels import TIMESTAMP
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.recording import columns

Row = tuple[tuple[Scalar, ...], float | None]
"""Flat values, and the host time of a recording that has it."""
Runs = Callable[[Sequence[Scalar]], bool]


@dataclass(slots=True)
class Plotted:
    """Columns over time. Where a curve is interrupted, they have NaN."""

    time: array[float] = field(default_factory=lambda: array("d"))
    """Seconds since the first package, or numbers of packages where the recording has no time."""
    values: dict[str, array[float]] = field(default_factory=dict)
    """Column -> values, as many as `time` has."""
    packages: int = 0
    """Packages that are drawn."""
    breaks: list[int] = field(default_factory=list)
    """Places of NaN."""

    @property
    def lone(self) -> list[int]:
        """Places of packages between two interruptions, which a line alone would not show."""
        ends = [-1, *self.breaks, len(self.time)]
        return [first + 1 for first, second in pairwise(ends) if second - first == 2]

    def add(self, moment: float, row: Iterable[Scalar], *, apart: bool) -> None:
        """Take in a package, the value of each column; `apart`: its curve is not joined to the package before."""
        if self.time and (apart or moment < self.time[-1]):
            self.breaks.append(len(self.time))
            self.time.append(self.time[-1])
            for values in self.values.values():
                values.append(math.nan)
        self.time.append(moment)
        for values, value in zip(self.values.values(), row, strict=True):
            values.append(value)
        self.packages += 1


def time_label(recipe: Recipe, *, host_time: bool) -> str:
    """What the horizontal axis shows."""
    return "time in s" if TIMESTAMP in recipe.slots or host_time else "package"


def plotted(
    rows: Iterable[Row],
    recipe: Recipe,
    wanted: Collection[str],
    *,
    gaps: Collection[int] = (),
    runs: Runs | None = None,
) -> Plotted:
    """The columns of the packages in which `runs` holds; `gaps` are the packages before which some are missing.

    Of the columns that are wanted a recording may have some only.
    """
    places = {name: place for place, name in enumerate(columns(recipe)) if name in wanted}
    found = Plotted(values={name: array("d") for name in places})
    slot = recipe.slots.get(TIMESTAMP)
    apart = False
    begin: float | None = None
    for number, (row, host_time) in enumerate(rows):
        apart = apart or number in gaps
        if runs is not None and not runs(row):
            apart = True
            continue
        moment = float(row[slot.start]) if slot is not None else number if host_time is None else host_time
        begin = moment if begin is None else begin
        found.add(moment - begin, [row[place] for place in places.values()], apart=apart)
        apart = False
    return found
