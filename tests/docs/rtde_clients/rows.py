"""What a user of another RTDE client has, and what there is here instead: the rows of docs/reference/rtde-clients.md.

The rows are in the .tsv files beside this module, one file for each client, written by hand: group, their name, what
it does, ours, and the tests that show it, as `FILE::FUNCTION` or `FILE::FUNCTION[ID]` below tests/, several with commas
between them. `ours` names things of `gatewayd.rtde` as `rtde.NAME`, commands as `gatewayd ...`; where there is nothing
it begins with "not" and gives the reason.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from pathlib import Path

from tests.docs.canopen import table

HERE = Path(__file__).parent
CLIENTS = ("python", "cpp", "dotnet")


@dataclass(frozen=True, slots=True)
class ShowingTest:
    """A test, or one case of it."""

    file: str
    function: str
    case: str | None

    @classmethod
    def parse(cls, text: str) -> ShowingTest:
        """Read `FILE::FUNCTION[ID]`."""
        file, _, name = text.partition("::")
        function, bracket, case = name.partition("[")
        return cls(file, function, case.removesuffix("]") if bracket else None)

    @property
    def link(self) -> str:
        """For the page: its name, and the case, with a link to its file."""
        words = self.function.removeprefix("test_").replace("_", " ")
        return f"[{words}{f': {self.case}' if self.case is not None else ''}](../../tests/{self.file})"


@dataclass(frozen=True, slots=True)
class Row:
    """Something public of another client."""

    client: str
    group: str
    name: str
    what: str
    ours: str
    tests: str

    @property
    def shown_by(self) -> tuple[ShowingTest, ...]:
        """The tests that show what `ours` says; none where there is nothing to show."""
        return tuple(map(ShowingTest.parse, filter(None, self.tests.split(", "))))

    @property
    def code(self) -> list[str]:
        """What `ours` has between backticks."""
        return re.findall(r"`([^`]*)`", self.ours)

    @property
    def references(self) -> list[str]:
        """Names of `gatewayd.rtde` in `ours`, without that prefix."""
        return [name for name in re.findall(r"`rtde\.([\w.]+)", self.ours) if not name.endswith("connect(")]

    @property
    def commands(self) -> list[str]:
        """Commands in `ours`, with options."""
        return re.findall(r"`gatewayd ((?:[a-z-]+ ?)+[^`]*)`", self.ours)

    @property
    def is_declined(self) -> bool:
        """Whether there is nothing, for a reason."""
        return self.ours.startswith("not")


@cache
def rows() -> tuple[Row, ...]:
    """All rows, client by client."""
    return tuple(row for client in CLIENTS for row in _read(client))


def _read(client: str) -> Iterator[Row]:
    with (HERE / f"{client}.tsv").open(newline="") as file:
        reader = csv.reader(file, delimiter="\t", quoting=csv.QUOTE_NONE)
        next(reader)
        for columns in reader:
            yield Row(client, *columns)


def part(client: str) -> str:
    """The tables of one client."""
    mine = [row for row in rows() if row.client == client]
    return "\n\n".join(
        f"### {group}\n\n" + table(("theirs", "what it does", "ours", "shown by"), map(_cells, members))
        for group, members in groupby(mine, key=lambda row: row.group)
    )


def _cells(row: Row) -> tuple[str, str, str, str]:
    return row.name, row.what, row.ours, "; ".join(test.link for test in row.shown_by)
