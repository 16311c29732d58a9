"""A register list as cells with their places in the file: encoding, delimiter, head line and rows found."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from gatewayd.cli.importing.register_list.columns import DETAIL, MEANINGS, column_of
from gatewayd.cli.importing.register_list.findings import ListFindings
from gatewayd.cli.importing.register_list.numbers import NotReadable, area, limits

MAX_BYTES: Final = 1024 * 1024
MAX_ROWS: Final = 5000
MAX_COLUMNS: Final = 500
MAX_CELL: Final = 2000
_DELIMITERS: Final = ",;\t|"
_HEAD_WITHIN: Final = 50
"""The head line is among the first so many lines that are not empty: titles may be before it."""
_END: Final = "\x1a"
"""A line of its own behind the list: where it belongs to a cell, a quotation mark is not closed."""
_MARKS: Final = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


@dataclass(frozen=True, slots=True)
class ListCell:
    """What stands in a column of a row, without blanks around it."""

    text: str
    line: int
    column: int
    goes_on: bool = False
    """Whether it goes on in further lines of the file."""

    @property
    def place(self) -> tuple[int, int]:
        """Line and column of the file, counted from 1."""
        return self.line, self.column


@dataclass(frozen=True, slots=True)
class ListRow:
    """One line of the list."""

    line: int
    cells: Mapping[str, ListCell]
    """By meaning of the column; what is empty is missing."""

    def text(self, column: str) -> str:
        """What stands there; empty if nothing does."""
        cell = self.cells.get(column)
        return "" if cell is None else cell.text

    def place(self, column: str) -> tuple[int, int]:
        """Where that stands; the beginning of the row if nothing does."""
        cell = self.cells.get(column)
        return (self.line, 1) if cell is None else cell.place


@dataclass(frozen=True, slots=True)
class ListTable:
    """All rows, and the meanings of the columns that were recognised."""

    columns: frozenset[str]
    rows: tuple[ListRow, ...]
    delimiter: str


def decoded(content: bytes, findings: ListFindings) -> str:
    """The text. Spreadsheets write UTF-8, UTF-16 with a mark, or Windows-1252."""
    encoding = next((name for mark, name in _MARKS.items() if content.startswith(mark)), "utf-8")
    try:
        return content.decode(encoding)
    except UnicodeDecodeError:
        text = content.decode("cp1252", "replace")
        place = next(iter(_places(text, lambda character: ord(character) > 0x7F)), (1, 1))
        findings.doubt(
            place, "the file is not UTF-8; read as Windows-1252", "see whether the letters are right"
        )
        return text


def table(text: str, findings: ListFindings) -> ListTable:
    """The rows. What keeps them from being read is an error among the findings, and the table is then empty."""
    wrong = next(iter(_places(text, lambda character: character < " " and character not in "\t\r\n")), None)
    if wrong is not None:
        findings.error(wrong, "a control character: this is no text", "save the list as CSV")
        return ListTable(frozenset(), (), ",")
    found = [
        (head, delimiter, records)
        for delimiter in _DELIMITERS
        if (records := _records(text, delimiter)) and (head := _head(records)) is not None
    ]
    if not found:
        findings.error(
            (1, 1),
            "no head line with a column for the address",
            f"name the columns in one of the first {_HEAD_WITHIN} lines, for example "
            "name,address,type,access,scale,unit,comment",
        )
        return ListTable(frozenset(), (), ",")
    head, delimiter, records = max(found, key=lambda choice: len(_meant(choice[2][choice[0]])))
    return _table(records[head], records[head + 1 :], delimiter, findings)


def _places(text: str, wanted: object) -> Iterator[tuple[int, int]]:
    assert callable(wanted)
    for number, line in enumerate(text.split("\n"), 1):
        for column, character in enumerate(line, 1):
            if wanted(character):
                yield number, column


def _records(text: str, delimiter: str) -> list[list[ListCell]]:
    """The records with anything in them, as many as a list may have and some more; none where this is no CSV."""
    lines = text.splitlines()
    reader = csv.reader(io.StringIO(f"{text}\n{_END}", newline=""), delimiter=delimiter, strict=False)
    records: list[list[ListCell]] = []
    before = 0
    try:
        for record in reader:
            if len(record) > MAX_COLUMNS:
                return []
            if not any(record) or record == [_END]:
                before = reader.line_num
                continue
            starts = _starts(lines[before], delimiter) if before < len(lines) else []
            records.append(
                [
                    ListCell(
                        " ".join(cell.split()),
                        before + 1,
                        starts[index] if index < len(starts) else 1,
                        goes_on=reader.line_num > before + 1 and "\n" in cell,
                    )
                    for index, cell in enumerate(record)
                ]
            )
            before = reader.line_num
            if len(records) > MAX_ROWS + _HEAD_WITHIN:
                break
    except csv.Error:
        return []
    return records


def _starts(line: str, delimiter: str) -> list[int]:
    """The columns at which the cells of a line begin, counted from 1."""
    starts, quoted = [1], False
    for column, character in enumerate(line, 1):
        if character == '"':
            quoted = not quoted
        elif character == delimiter and not quoted:
            starts.append(column + 1)
    return starts


def _head(records: Sequence[Sequence[ListCell]]) -> int | None:
    """The first line that names a column for addresses and one more."""
    for index, record in enumerate(records[:_HEAD_WITHIN]):
        meant = _meant(record)
        if len(meant) > 1 and meant & {"address", "notation"}:
            return index
    return None


def _meant(record: Sequence[ListCell]) -> frozenset[str]:
    return frozenset(filter(None, (column_of(cell.text) for cell in record)))


def _table(
    head: Sequence[ListCell], records: Sequence[Sequence[ListCell]], delimiter: str, findings: ListFindings
) -> ListTable:
    columns: list[str] = []
    for index, cell in enumerate(head):
        column = _column(cell, [record[index].text for record in records if index < len(record)], delimiter)
        if column and column != DETAIL and column in columns:
            findings.error(cell.place, f"two columns for the {MEANINGS[column]}", "delete one, or rename it")
        elif not column and cell.text:
            findings.doubt(
                cell.place, f"the column `{cell.text[:40]}` is not used", "delete it if that is right"
            )
        columns.append(column)
    rows = [_row(columns, record, findings) for record in records if any(cell.text for cell in record)]
    if len(rows) > MAX_ROWS:
        findings.error((rows[MAX_ROWS].line, 1), f"more than {MAX_ROWS} rows", "split the list into several")
        rows = []
    return ListTable(frozenset(filter(None, columns)), tuple(rows), delimiter)


def _column(head: ListCell, texts: Iterable[str], delimiter: str) -> str:
    """The meaning of a column by its name; one called `Bereich` has areas, or limits if its cells look like these."""
    column = column_of(head.text)
    if column != "area":
        return column
    filled = [text for text in texts if text]
    has_limits = any(_is_readable(text, lambda cell: limits(cell, comma=delimiter != ",")) for text in filled)
    return "limits" if has_limits and not any(_is_readable(text, area) for text in filled) else column


def _is_readable(text: str, read: Callable[[str], object]) -> bool:
    try:
        read(text)
    except NotReadable:
        return False
    return True


def _row(columns: Sequence[str], record: Sequence[ListCell], findings: ListFindings) -> ListRow:
    cells: dict[str, ListCell] = {}
    for index, listed in enumerate(record):
        cell = listed
        if cell.text.endswith(_END):
            text = "a quotation mark is not closed: all that follows would be this cell"
            findings.error(cell.place, text, "close it, or write it twice where it belongs to the text")
            cell = replace(cell, text=cell.text.removesuffix(_END).rstrip())
        elif cell.goes_on:
            text = "a text in quotation marks goes on in the next line"
            findings.repeated_doubt(cell.place, text, "see whether rows are missing: a quotation mark may be")
        if len(cell.text) > MAX_CELL:
            findings.error(
                cell.place, f"more than {MAX_CELL} characters in one cell", "see the quotation marks"
            )
        elif index >= len(columns) and cell.text:
            findings.error(cell.place, "more cells than columns", "quote a text with the delimiter in it")
        elif index < len(columns) and columns[index] and cell.text:
            cells[columns[index]] = cell
    return ListRow(record[0].line, cells)
