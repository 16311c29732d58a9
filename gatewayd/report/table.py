"""The table of a cell: what lies where, who may write it, and what is seen when a side is lost.

The kinds of links say where variables lie, and have columns and tables of their own.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from gatewayd.core.definition import Direction, Fallback
from gatewayd.links.registry import languages, tables
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.plan import Plan
from gatewayd.report.layout import Column, Row, arranged, plain
from gatewayd.report.printable import json_document, printable
from gatewayd.report.wording import number

_COLUMNS: Final = tuple(
    Column(name)
    for name in (
        "number", "name", "direction", "unit", "low", "high", "clamp", "owner", "lease", "takeover", "group",
        "on_release", "on_stale", "comment", "whole", "valid",
    )
)  # fmt: skip
_PAGE: Final = tuple(
    Column(name) for name in ("no.", "name", "direction", "value", "limits", "owner", "when lost", "comment")
)


def columns() -> tuple[str, ...]:
    """Names of the columns in CSV and JSON."""
    further = (column for link in tables() for column in link.columns)
    return tuple(column.name for column in arranged(_COLUMNS, further))


def rows(cell: ExpandedCell) -> tuple[Row, ...]:
    """The table of a cell without errors, in file order."""
    links = [link.rows(cell) for link in tables()]
    empty = {column.name: column.empty for link in tables() for column in link.columns}
    return tuple(
        _row(cell, variable, {**empty, **place})
        for variable in cell.variables
        for place in _places([link.get(variable.index, ()) for link in links])
    )


def _places(links: Sequence[Sequence[Mapping[str, object]]]) -> Iterator[Mapping[str, object]]:
    """The places of one variable side by side, as many as the link with the most has."""
    for place in range(max(1, *map(len, links))):
        yield {
            name: value
            for places in links
            if places
            for name, value in places[min(place, len(places) - 1)].items()
        }


def by_line(cell: ExpandedCell) -> tuple[tuple[Row, Row], ...]:
    """The table with one entry for each line of the file and place: its first and its last row."""
    ends: dict[tuple[str, int], tuple[Row, Row]] = {}
    placed: dict[int, int] = {}
    for row in rows(cell):
        place = placed[row.number] = placed.get(row.number, -1) + 1
        key = cell.variables[row.number - 1].part.name, place
        first, _ = ends.setdefault(key, (row, row))
        ends[key] = first, row
    return tuple(ends.values())


def _row(cell: ExpandedCell, variable: ExpandedVariable, places: Mapping[str, object]) -> Row:
    spec = variable.spec
    lock = cell.locks[variable.lock] if variable.lock is not None else None
    low, high = spec.limits if spec.limits is not None else (None, None)
    is_input = variable.direction is Direction.INPUT
    owner = ""
    if lock is not None:
        owner = "any" if lock.is_any else (" > " if lock.takeover else ", ").join(lock.owners)
    return Row(
        number=variable.index + 1,
        name=variable.name,
        direction=variable.direction.value,
        unit=spec.unit,
        low=low,
        high=high,
        clamp=spec.clamp,
        owner=owner,
        lease=lock.lease if lock is not None else None,
        takeover=lock is not None and lock.takeover,
        group=lock.name if lock is not None and lock.group is not None else "",
        on_release=_fallback(spec.on_release) if is_input else "",
        on_stale="" if is_input else _fallback(spec.on_stale),
        comment=spec.comment,
        whole=lock is not None and lock.whole,
        valid="running" if variable.valid_running else "",
        places=places,
    )


def _fallback(fallback: Fallback) -> str:
    if fallback.value is None:
        return fallback.kind.value
    return plain(fallback.value) if isinstance(fallback.value, bool) else number(fallback.value)


def as_csv(table: Sequence[Row]) -> str:
    """Comma separated values with a head line; what does not apply is empty, truth is true or false."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    head = columns()
    writer.writerow(head)
    writer.writerows([printable(plain(row[column])) for column in head] for row in table)
    return text.getvalue()


def as_json(plan: Plan, cell: ExpandedCell, table: Sequence[Row]) -> str:
    """One JSON document: `version`, `cell`, `fingerprint`, one key for each kind of link (null: the cell has none),
    `variables`.

    `variables` is a list of rows, `canopen` has the PDO table and the load of the bus by bit-rate.

    Keys are only ever added within a version.
    """
    defining = {language.key for language in languages() if language.defines}
    document = {
        "version": 1,
        "cell": plan.cell.name,
        "fingerprint": f"{plan.cell.fingerprint:08X}",
        **{
            link.key: link.document(plan, cell) if link.key in plan.kinds else None
            for link in tables()
            if link.key not in defining
        },
        "variables": [{column: row[column] for column in columns()} for row in table],
    }
    return json_document(document)


def as_markdown(plan: Plan, cell: ExpandedCell, table: Sequence[Row]) -> str:
    """A Markdown page with the columns that a PLC programmer needs; the tables of the links after it."""
    here = [link for link in tables() if link.key in plan.kinds]
    lines = [f"# Registers of {plan.cell.name}", ""]
    introductions = [text for link in here if (text := link.introduction(plan))]
    if introductions:
        fingerprint = f"Fingerprint of the mapping: {plan.cell.fingerprint:08X}."
        lines += [" ".join((*introductions, fingerprint)), ""]
    further = (column for link in tables() for column in (link.columns if link.page is None else link.page))
    head = [column.name for column in arranged(_PAGE, further)]
    lines += _markdown(head, (_on_page(row, head) for row in table))
    for link in here:
        further_table = link.page_table(cell)
        if further_table is not None:
            texts = [
                [cell if isinstance(cell, str) else cell[0] for cell in row] for row in further_table.rows
            ]
            lines += ["", f"## {further_table.title}", "", *_markdown(further_table.head, texts)]
            lines += ["", *further_table.notes] if further_table.notes else []
    legend = [f"- {text}" for link in here for text in link.legend(cell)]
    lines += ["", "## Modes, states and status bits", "", *legend] if legend else []
    return "\n".join(lines) + "\n"


def _markdown(head: Sequence[str], table: Iterable[Sequence[str]]) -> Iterator[str]:
    yield from ("| " + " | ".join(head) + " |", "|" + "---|" * len(head))
    for texts in table:
        yield "| " + " | ".join(map(_cell, texts)) + " |"


def _on_page(row: Row, head: Sequence[str]) -> Sequence[str]:
    texts = {
        "no.": str(row.number),
        "name": row.name,
        "direction": row.direction,
        "value": formula(row),
        "limits": limits(row),
        "owner": policy(row),
        "when lost": lost(row),
        "comment": row.comment,
    }
    for link in tables():
        texts = {**link.on_page(row), **texts}
    return [texts.get(name, "") for name in head]


def formula(row: Row) -> str:
    """How the raw number becomes the robot's value, with its unit: `raw * 0.1 N`; the unit alone for 1:1."""
    conversions = (link.conversion(row) for link in tables())
    return f"{next(filter(None, conversions), '')} {row.unit}".strip()


def limits(row: Row) -> str:
    """`0..150`, and whether a value outside is clamped."""
    if row.low is None or row.high is None:
        return ""
    return f"{row.low:.10g}..{row.high:.10g}" + (" clamped" if row.clamp else "")


def policy(row: Row) -> str:
    """Who may own it and for how long: `plc > hmi, 5s`; with the group that it is owned with, `(motion, whole)`."""
    lease = "" if row.lease is None else f", {row.lease:.6g}s"
    group = f" ({row.group}{', whole' if row.whole else ''})" if row.group else ""
    return f"{row.owner}{lease}{group}"


def lost(row: Row) -> str:
    """What is seen when a side is lost: `clear`; `clear, running` where that is so without a running program too."""
    return (row.on_release or row.on_stale) + (f", {row.valid}" if row.valid else "")


def _cell(text: str) -> str:
    return printable(" ".join(text.replace("|", "\\|").split()))
