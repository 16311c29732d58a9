"""Columns, rows and tables in the form in which the kinds of links hand them to `show` and its other forms."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

Text = str | tuple[str, str]
"""A text, or a text and its style on a screen."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table."""

    name: str
    before: str = ""
    """The column that it stands before; the others come last."""
    empty: object = ""
    """What stands in it for a variable that the link does not have."""
    whole: bool = True
    """Whether it is kept in one piece where the screen is wide enough."""
    coloured: bool = False
    """Whether it has the colour of the variable's direction on a screen."""


def arranged(own: Sequence[Column], further: Iterable[Column]) -> tuple[Column, ...]:
    """The columns of a table with those of the links at their places; of several with one name the first counts."""
    columns = list(own)
    for column in further:
        names = [known.name for known in columns]
        if column.name not in names:
            columns.insert(names.index(column.before) if column.before in names else len(columns), column)
    return tuple(columns)


@dataclass(frozen=True, slots=True)
class ReportTable:
    """A table of a link's own, below that of the variables."""

    head: tuple[str, ...]
    rows: Sequence[Sequence[Text]]
    title: str = ""
    notes: tuple[str, ...] = ()
    """Lines below it."""


@dataclass(frozen=True, slots=True)
class Row:
    """One variable at one place; a variable with several places has several rows, one with none has one."""

    number: int
    """As the status block counts the variable, from 1."""
    name: str
    direction: str
    """`input` (fieldbus to robot) or `output` (robot to fieldbus)."""
    unit: str
    low: float | None
    """Limits in the robot's unit; None where there are none."""
    high: float | None
    clamp: bool
    owner: str
    """Writers by priority, `plc > hmi` where the first takes over, else `plc, hmi`; `any`; empty for outputs."""
    lease: float | None
    """Seconds; None for no lease."""
    takeover: bool
    group: str
    on_release: str
    """Inputs: what the robot is given when the owner is lost."""
    on_stale: str
    """Outputs: what the fieldbus sees when the robot stops reporting."""
    comment: str
    whole: bool
    """Whether its group is taken over only by writing all of it."""
    valid: str
    """`running`: good only while the robot program runs; empty: always."""
    places: Mapping[str, object] = field(default_factory=dict)
    """The columns of the kinds of links, by name."""

    def __getitem__(self, column: str) -> Any:
        """What stands in a column."""
        return self.places[column] if column in self.places else getattr(self, column)


def plain(value: object) -> str:
    """A value as text: nothing is empty, truth is true or false."""
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else str(value)


def span(first: str, last: str) -> str:
    """From one place to another: `100-147`; one of them where they are the same."""
    return first if first == last else f"{first}-{last}"
