"""What was found, for people and for programs: lines as they come, then what to do. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count

from gatewayd.links.examination import Observation, Outcome
from gatewayd.report.format import counted, listed
from gatewayd.report.printable import json_document, printable

_LISTED = 4
_LINK, _CHECK, _OUTCOME = 9, 15, 8
"""Widths of columns."""
_ORDER = (Outcome.PROBLEM, Outcome.WARNING)
"""What is most important comes first; within it, what other things need."""


@dataclass(frozen=True, slots=True)
class CheckLine:
    """One observation, and what it is of."""

    cell: str
    """Empty: of this machine."""
    link: str
    """Name of the link; or `mapping`, `gateway`."""
    observation: Observation


@dataclass(frozen=True, slots=True)
class Advice:
    """One thing to do."""

    cells: tuple[str, ...]
    """Where it was found; empty: on this machine."""
    link: str
    observation: Observation


@dataclass(slots=True)
class DoctorReport:
    """One run of `gatewayd doctor`."""

    files: tuple[str, ...] = ()
    """Files that were read."""
    unreadable: tuple[tuple[str, str], ...] = ()
    """Files that were not, and why."""
    lines: list[CheckLine] = field(default_factory=list)
    """In the order in which they were found."""

    @property
    def advice(self) -> list[Advice]:
        """What to do, most important first; the same of several cells once."""
        cells: dict[tuple[str, Observation], dict[str, None]] = {}
        for line in self.lines:
            if line.observation.outcome.is_finding:
                found = cells.setdefault((line.link, line.observation), {})
                if line.cell:
                    found[line.cell] = None
        all_of_it = [Advice(tuple(where), *what) for what, where in cells.items()]
        return sorted(all_of_it, key=lambda advice: _ORDER.index(advice.observation.outcome))


def line_text(line: CheckLine) -> tuple[str, str, str]:
    """A line for people in three parts: what is looked at, the outcome, and what was found."""
    seen = line.observation
    head = f"  {line.link.ljust(_LINK)} {seen.check.ljust(_CHECK)} "
    return printable(head), seen.outcome.value.ljust(_OUTCOME), printable(f" {seen.text}")


def advice_text(report: DoctorReport) -> Iterator[str]:
    """What to do, for people; a line that says how many checks were made."""
    advice = report.advice
    if advice:
        yield "What to do, the most important first:"
    for number, item in zip(count(1), advice, strict=False):
        seen = item.observation
        where = f"{listed(item.cells, _LISTED)}, " if item.cells else ""
        yield printable(f"{number:>3}. {where}{item.link}: {seen.text}")
        if seen.cause:
            yield printable(f"     cause:  {seen.cause}")
        if seen.remedy:
            yield printable(f"     remedy: {seen.remedy}")
    yield _summary(report, advice)


def _summary(report: DoctorReport, advice: Sequence[Advice]) -> str:
    skipped = sum(line.observation.outcome is Outcome.SKIPPED for line in report.lines)
    made = counted(len(report.lines) - skipped, "check")
    parts = [made, *([f"{skipped} not made"] if skipped else [])]
    found = {outcome: sum(item.observation.outcome is outcome for item in advice) for outcome in _ORDER}
    todo = ", ".join(counted(number, outcome.value) for outcome, number in found.items() if number)
    return f"{', '.join(parts)}: {todo or 'nothing to do'}"


def as_json(report: DoctorReport) -> str:
    """One JSON document: `version` 1, `well`, `files`, `unreadable`, `checks`, `advice`.

    A check has `cell` and `link` (or null), `check`, `outcome` (`ok`, `note`, `skipped`, `warning`, `problem`), `text`,
    `cause` and `remedy` (or null). `advice` has the findings among them in the order of their importance, with `cells`
    in place of `cell`. Keys are only ever added within a version; texts may change at any time.
    """
    document = {
        "version": 1,
        "well": not report.advice and not report.unreadable,
        "files": list(report.files),
        "unreadable": [{"file": file, "reason": reason} for file, reason in report.unreadable],
        "checks": [
            {"cell": line.cell or None, "link": line.link, **_as_object(line.observation)}
            for line in report.lines
        ],
        "advice": [
            {"cells": list(item.cells), "link": item.link, **_as_object(item.observation)}
            for item in report.advice
        ],
    }
    return json_document(document)


def _as_object(seen: Observation) -> dict[str, str | None]:
    return {
        "check": seen.check,
        "outcome": seen.outcome.value,
        "text": seen.text,
        "cause": seen.cause or None,
        "remedy": seen.remedy or None,
    }
