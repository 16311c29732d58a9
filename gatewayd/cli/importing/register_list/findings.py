"""The findings of a register list: each at its cell, and what every row has said once."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Final

from gatewayd.cli.importing.findings import FindingKind, ImportFinding
from gatewayd.report.format import counted

MAX_ERRORS: Final = 200
"""So many are listed: a list that is read the wrong way has one in every cell."""
_MAX_LINES: Final = 10
"""Lines that are named of an error that many rows have."""
Place = tuple[int, int]


@dataclass(slots=True)
class ListFindings:
    """All of them. Of a doubt that every row has, the first is kept, with the number of the others."""

    found: list[ImportFinding] = field(default_factory=list)
    errors: int = 0
    _listed: int = 0
    """Errors that are listed one by one."""
    _doubts: defaultdict[tuple[str, str], list[Place]] = field(default_factory=lambda: defaultdict(list))
    _missing: defaultdict[tuple[str, str], list[Place]] = field(default_factory=lambda: defaultdict(list))

    def error(self, place: Place, text: str, hint: str = "") -> None:
        """Something that keeps the list from being imported."""
        self.errors += 1
        self._listed += 1
        if self._listed <= MAX_ERRORS:
            self.found.append(ImportFinding(*place, text, hint=hint))

    def doubt(self, place: Place, text: str, hint: str = "") -> None:
        """Something that was understood in one of several ways."""
        self.found.append(ImportFinding(*place, text, FindingKind.DOUBT, hint))

    def repeated_doubt(self, place: Place, text: str, hint: str) -> None:
        """A doubt that may be the same in every row: said once."""
        self._doubts[text, hint].append(place)

    def repeated_error(self, place: Place, text: str, hint: str) -> None:
        """An error that may be the same in every row: said once, with the lines."""
        self.errors += 1
        self._missing[text, hint].append(place)

    @property
    def failed(self) -> bool:
        """Whether there is an error."""
        return self.errors > 0

    def all(self) -> list[ImportFinding]:
        """By line and column; of very many errors the first."""
        merged = [
            ImportFinding(*places[0], f"{text}{_more(places)}", FindingKind.DOUBT, hint)
            for (text, hint), places in self._doubts.items()
        ]
        merged += [
            ImportFinding(*places[0], f"{text}{_lines(places)}", hint=hint)
            for (text, hint), places in self._missing.items()
        ]
        listed = sorted([*self.found, *merged], key=lambda finding: (*finding.place, finding.text))
        if self._listed > MAX_ERRORS:
            last = listed[-1]
            listed.append(ImportFinding(*last.place, f"and {self._listed - MAX_ERRORS} more"))
        return listed


def _more(places: list[Place]) -> str:
    return f" (and {len(places) - 1} more)" if len(places) > 1 else ""


def _lines(places: list[Place]) -> str:
    if len(places) == 1:
        return ""
    named = ", ".join(str(line) for line, _column in places[:_MAX_LINES])
    left = len(places) - _MAX_LINES
    return f" ({counted(len(places), 'row')}: lines {named}{f' and {left} more' if left > 0 else ''})"
