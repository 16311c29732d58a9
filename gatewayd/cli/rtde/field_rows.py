"""The rows of `gatewayd rtde fields`: what the catalogue says of each field, and what a controller answered. Pure."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

from gatewayd.report.printable import printable
from gatewayd.report.wording import family
from gatewayd.rtde.catalogue import likely_holders
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Field, Series, SoftwareVersion
from gatewayd.rtde.messages import IN_USE, NOT_FOUND

_NUMBER = re.compile(r"[0-9]+$")


@dataclass(frozen=True, slots=True)
class FieldRow:
    """One field in one direction."""

    name: str
    direction: str
    """`output` (from the robot) or `input`."""
    type: str
    """As the controller answered, be it NOT_FOUND or IN_USE; without a controller as the catalogue has it."""
    catalogue: str
    """The type in the catalogue; empty: it does not have the field."""
    unit: str
    since: str
    """First versions, by series: `cb3 3.12.0, e 5.5.1`; empty: from the start of all."""
    comment: str
    holder: str = ""
    """Of an input that is in use: who probably holds it."""


def catalogue_rows(series: Series | None, version: SoftwareVersion | None) -> list[FieldRow]:
    """What a controller of this series and software has; None: of any."""
    return [
        _row(known, direction, known.type.word)
        for direction, table in _TABLES
        for known in table.values()
        if series is None or known.available(series, version)
    ]


def answered_rows(
    outputs: Mapping[str, str], inputs: Mapping[str, str], software: SoftwareVersion | None = None
) -> list[FieldRow]:
    """What a controller with this software answered, by direction and in its order."""
    answers = {"output": outputs, "input": inputs}
    return [
        replace(
            _row(table.get(name), direction, word, name),
            holder=likely_holders(name, software) if word == IN_USE else "",
        )
        for direction, table in _TABLES
        for name, word in answers[direction].items()
    ]


def remark(row: FieldRow) -> str:
    """What a table for people says of the row: who holds it, or else what it is."""
    return f"in use, probably by {row.holder}" if row.holder else row.comment


def is_there(row: FieldRow) -> bool:
    """Whether the controller has the field, be it in use elsewhere."""
    return row.type != NOT_FOUND


def folded(rows: Sequence[FieldRow]) -> list[FieldRow]:
    """The rows with those of registers that differ in their numbers alone as one: `input_int_register_0..47`."""
    runs: list[tuple[FieldRow, FieldRow]] = []
    for row in rows:
        if runs and _follows(runs[-1][1], row):
            runs[-1] = runs[-1][0], row
        else:
            runs.append((row, row))
    return [replace(first, name=family(first.name, last.name)) for first, last in runs]


def as_csv(rows: Iterable[FieldRow]) -> str:
    """A line for each row below one with the names of the columns."""
    stream = io.StringIO()
    columns = list(FieldRow.__dataclass_fields__)
    writer = csv.DictWriter(stream, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(as_object(row) for row in rows)
    return stream.getvalue()


def as_object(row: FieldRow) -> dict[str, str]:
    """For programs: `name`, `direction`, `type`, `catalogue`, `unit`, `since`, `comment`, `holder`."""
    return {name: printable(text) for name, text in asdict(row).items()}


_TABLES: tuple[tuple[str, Mapping[str, Field]], ...] = (("output", OUTPUTS), ("input", INPUTS))


def _row(known: Field | None, direction: str, word: str, name: str = "") -> FieldRow:
    if known is None:
        return FieldRow(name, direction, word, "", "", "", "not in the catalogue")
    return FieldRow(known.name, direction, word, known.type.word, known.unit, _since(known), known.comment)


def _since(known: Field) -> str:
    if not any(map(known.exists, Series)):
        return "no known version"
    texts = {
        series.word: "never" if not known.exists(series) else str(known.first_version(series) or "")
        for series in Series
    }
    return ", ".join(f"{series} {text}" for series, text in texts.items() if text)


def _follows(before: FieldRow, row: FieldRow) -> bool:
    """Whether the row is that of the next register, and says the same of it."""
    one, other = _NUMBER.search(before.name), _NUMBER.search(row.name)
    if one is None or other is None or int(other[0]) != int(one[0]) + 1:
        return False
    return replace(before, name=before.name[: one.start()]) == replace(row, name=row.name[: other.start()])
