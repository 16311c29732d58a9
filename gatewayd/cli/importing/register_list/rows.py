"""A row of a register list as a place: where it lies, how its number is written, who writes it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, TypeVar

from gatewayd.cli.importing.register_list import numbers
from gatewayd.cli.importing.register_list.findings import ListFindings
from gatewayd.cli.importing.register_list.numbers import BIT_AREAS, WORDS, Address, NotReadable
from gatewayd.cli.importing.register_list.table import ListRow, ListTable
from gatewayd.report.format import counted

Counting = str
"""How plain addresses are counted: `from-0`, `from-1`; `traditional`: 40001 is holding register 0; empty: not said."""
FROM_0, FROM_1, TRADITIONAL, UNSAID = "from-0", "from-1", "traditional", ""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*(\[\d{1,4}\])?")
_WORD_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
_LETTERS: Final = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss"})
_MAX_NAME: Final = 64
_READ: Final = frozenset({"r", "ro", "read", "readonly", "lesen", "nurlesen", "l"})
_WRITE: Final = frozenset(
    {"w", "wo", "rw", "write", "writeonly", "readwrite", "schreiben", "lesenschreiben", "ls", "s"}
)
_OWN_BITS: Final = 16
_Read = TypeVar("_Read")


@dataclass(frozen=True, slots=True)
class ListedPlace:
    """One row, understood."""

    row: ListRow
    name: str
    is_input: bool
    """Towards the robot."""
    robot: str
    """The robot's field; empty: the list names none."""
    area: str
    address: int
    part: str
    """Bit, `high` or `low`; empty."""
    type: str
    """Empty: that of the robot's field."""
    order: str
    scale: float | None
    offset: float | None
    limits: tuple[float, float] | None
    lease: float | None
    """Seconds."""


def places(table: ListTable, counting: Counting, findings: ListFindings) -> list[ListedPlace]:
    """The rows that are understood; what is not is an error among the findings."""
    if "name" not in table.columns and table.rows:
        findings.error((table.rows[0].line, 1), "no column for the name", "add a column `name`")
        return []
    reader = _RowReader(table, _counting(table, counting), findings)
    return [place for row in table.rows if (place := reader.place(row)) is not None]


def _counting(table: ListTable, counting: Counting) -> Counting:
    """From 0 for certain where an address is 0, or where 4xxxxx addresses stand beside."""
    if counting == UNSAID and ("notation" in table.columns or any(_is_zero(row) for row in table.rows)):
        return FROM_0
    return counting


def _is_zero(row: ListRow) -> bool:
    return re.fullmatch(r"0(\.\d+)?|0x0+|%MW0", row.text("address"), re.IGNORECASE) is not None


class _RowReader:
    def __init__(self, table: ListTable, counting: Counting, findings: ListFindings) -> None:
        self._columns = table.columns
        self._comma = table.delimiter != ","
        self._counting = counting
        self._findings = findings

    def place(self, row: ListRow) -> ListedPlace | None:
        """None with an error where a cell cannot be understood."""
        for column, what in (("canopen", "CANopen objects"), ("device", "places on devices")):
            if row.text(column):
                only = not row.text("address") and not row.text("notation")
                name = "CANopen" if column == "canopen" else "devices"
                hint = "delete the row: it has no register" if only else f"delete the columns for {name}"
                self._error(row, column, f"{what} are not imported", hint)
                return None
        before = self._findings.errors
        name, found = self._name(row), self._address(row)
        area = self._area(row, found)
        part = self._part(row, found)
        kind = self._type(row, area, part)
        place = ListedPlace(
            row=row,
            name=name,
            is_input=self._is_input(row, area, found),
            robot=row.text("robot"),
            area=area,
            address=found.number if found is not None else 0,
            part=part,
            type="bit" if area in BIT_AREAS or (part and kind in ("", "bool", "bit")) else kind,
            order=self._order(row, kind, area),
            scale=self._number(row, "scale"),
            offset=self._number(row, "offset"),
            limits=self._limits(row),
            lease=self._number(row, "lease"),
        )
        self._names(row)
        return place if self._findings.errors == before else None

    def _name(self, row: ListRow) -> str:
        written = row.text("name")
        if _NAME.fullmatch(written) and len(written) <= _MAX_NAME:
            return written
        name = re.sub(r"[^A-Za-z0-9]+", "_", written.translate(_LETTERS)).strip("_")[:_MAX_NAME].rstrip("_")
        if not re.match(r"[A-Za-z]", name):
            wrong = f"`{written}` is no name" if written else "no name"
            self._error(row, "name", wrong, "begin with a letter, then letters, digits and `_`")
        else:
            self._findings.doubt(
                row.place("name"), f"`{written}` is called `{name}`", "names have no blanks and marks"
            )
        return name

    def _names(self, row: ListRow) -> None:
        """Of writers and groups, which are taken as they are."""
        for column, names in (
            ("owner", re.split(r"[>,]", row.text("owner"))),
            ("group", [row.text("group")]),
        ):
            for name in names:
                if row.text(column) and not _WORD_NAME.fullmatch(name.strip()):
                    hint = "begin with a letter, then letters, digits and `_`"
                    self._error(row, column, f"`{name.strip()[:60]}` is no name", hint)

    def _address(self, row: ListRow) -> Address | None:
        column = "address" if row.text("address") else "notation"
        if not row.text(column):
            self._error(row, "address", "no address", "write a register, for example 100 or 400101")
            return None
        found = self._read(row, column, numbers.address)
        if found is None:
            return None
        counted = self._counted(row, column, found)
        if column == "address" and row.text("notation"):
            self._compare(row, counted)
        return counted

    def _counted(self, row: ListRow, column: str, found: Address) -> Address:
        """The address from 0."""
        text, place = row.text(column), row.place(column)
        if found.doubt:
            self._findings.repeated_doubt(place, found.doubt, found.hint)
        if found.doubtful:
            plain = int(text.partition(".")[0])
            if self._counting in (FROM_0, FROM_1):
                return self._shifted(row, Address(plain, None, found.part), column)
            if self._counting == UNSAID:
                self._findings.repeated_doubt(
                    place,
                    "five digits are taken as an address with the area before it: 40001 is holding register 0",
                    "--addresses traditional if that is right",
                )
            return found
        if found.area is None and not found.hexadecimal and self._counting == UNSAID:
            self._findings.repeated_doubt(
                place,
                "addresses are taken as counted from 0",
                "--addresses from-1 if the first register is 1, --addresses from-0 if that is right",
            )
        return self._shifted(row, found, column)

    def _shifted(self, row: ListRow, found: Address, column: str) -> Address:
        if self._counting != FROM_1 or found.area is not None:
            return found
        if found.number == 0:
            self._error(
                row, column, "the address 0 in a list that counts from 1", "leave --addresses from-1 out"
            )
        return replace(found, number=found.number - 1)

    def _compare(self, row: ListRow, found: Address) -> None:
        """The two forms of one address in one row."""
        other = self._read(row, "notation", numbers.address)
        if other is not None and other.number != found.number:
            text = f"`{row.text('notation')}` is address {other.number} from 0, not {found.number}"
            self._error(row, "notation", text, "correct one of the two")

    def _area(self, row: ListRow, found: Address | None) -> str:
        said = self._read(row, "area", numbers.area) if row.text("area") else None
        by_function = self._read(row, "function", numbers.function_area) if row.text("function") else None
        by_address = None if found is None else found.area
        named = [area for area in (said, by_function, by_address) if area is not None]
        if len(set(named)) > 1:
            column = "area" if said is not None else "function"
            text = f"the area is {named[0]} here, and {next(area for area in named if area != named[0])} elsewhere"
            self._error(row, column, text, "correct one of them")
        return named[0] if named else "holding"

    def _type(self, row: ListRow, area: str, part: str) -> str:
        words = self._read(row, "words", numbers.whole) if row.text("words") else None
        if not row.text("type"):
            return "" if part or area in BIT_AREAS else self._untyped(row, words)
        found = self._read(row, "type", numbers.number_type)
        if found is None:
            return ""
        kind, doubtful = found
        if doubtful:
            kind = self._settled(row, kind, words)
        if words is not None and area not in BIT_AREAS and words != WORDS[kind]:
            text = f"{kind} has {counted(WORDS[kind], 'register')}, the list says {words}"
            self._error(row, "words", text, "correct the type or the length")
        return kind

    def _untyped(self, row: ListRow, words: int | None) -> str:
        """The type where the list has none: the usual one of the robot's field, or a whole number of that length."""
        kind = "" if words is None else {1: "int16", 2: "int32", 4: "int64"}.get(words, "")
        taken = kind or "the usual one of the robot's field"
        text = f"no type is said: {taken} is taken"
        self._findings.repeated_doubt(
            row.place("address"), text, "add a column `type`: uint16, int32, float32 ..."
        )
        return kind

    def _order(self, row: ListRow, kind: str, area: str) -> str:
        """Empty where there is nothing to order, or where the usual one is taken, which is a doubt."""
        order = self._read(row, "order", numbers.word_order) or ""
        if not row.text("order") and area not in BIT_AREAS and WORDS.get(kind, 1) > 1:
            self._findings.repeated_doubt(
                row.place("type"),
                "no byte order is said: ABCD is taken, the high word first",
                "add a column `byte order`: ABCD, or CDAB where the low word is first",
            )
        return order

    def _settled(self, row: ListRow, kind: str, words: int | None) -> str:
        """A type whose name alone does not say how long it is."""
        longer = {"int16": {2: "int32", 4: "int64"}, "float32": {4: "float64"}}[kind]
        if words is not None:
            return longer.get(words, kind)
        text = f"`{row.text('type')}` is taken as {kind}, as in IEC 61131-3"
        self._findings.repeated_doubt(row.place("type"), text, f"write {kind} or {longer.get(2, 'float64')}")
        return kind

    def _part(self, row: ListRow, found: Address | None) -> str:
        bit = row.text("bit")
        if not bit:
            return "" if found is None else found.part
        number = self._read(row, "bit", numbers.whole)
        if number is not None and not 0 <= number < _OWN_BITS:
            self._error(
                row, "bit", f"a register has no bit {number}", "0 is the least significant, 15 the most"
            )
        if row.text("type") in ("int8", "uint8"):
            return "high" if number else "low"
        return "" if number is None else str(number)

    def _is_input(self, row: ListRow, area: str, found: Address | None) -> bool:
        """Whether it goes to the robot: the robot's field says it, else the access, the area, or the address."""
        robot = row.text("robot")
        if robot:
            return self._checked(row, robot)
        written = re.sub(r"[^a-z]", "", row.text("access").lower())
        if written in _WRITE | _READ:
            if written in _WRITE and area in ("input", "discrete"):
                self._error(
                    row, "access", f"nobody writes into the area {area}", "correct the access or the area"
                )
            return written in _WRITE
        if written:
            self._error(row, "access", f"`{row.text('access')}` is no access", "write R, W or RW")
        if row.text("direction") in ("input", "output"):
            return row.text("direction") == "input"
        if area in ("input", "discrete"):
            return False
        if found is not None and found.written is not None:
            return found.written
        if not written:
            self._findings.repeated_error(
                row.place("access"),
                "not said whether the PLC writes or reads it",
                "add a column `access`: R, W or RW",
            )
        return False

    def _checked(self, row: ListRow, robot: str) -> bool:
        is_input = not robot.startswith("output_") and self._names_input(row, robot)
        said = row.text("direction")
        if said in ("input", "output") and (said == "input") != is_input:
            self._error(
                row, "direction", f"{robot} is no {said}", "the direction follows from the robot's field"
            )
        return is_input

    def _names_input(self, row: ListRow, robot: str) -> bool:
        from gatewayd.rtde.fields import INPUTS

        field = re.split(r"[.\[]", robot)[0]
        bit = re.fullmatch(r"input_bit_register_\d+", field) is not None
        return bit or field in INPUTS

    def _limits(self, row: ListRow) -> tuple[float, float] | None:
        low, high = self._number(row, "low"), self._number(row, "high")
        both = self._read(row, "limits", lambda text: numbers.limits(text, comma=self._comma))
        if both is not None and (low is not None or high is not None):
            self._error(row, "limits", "limits here, and in a column of their own", "give them once")
            return None
        column = "limits" if both is not None else "low"
        low, high = both or (low, high)
        if low is None or high is None:
            if low is not None or high is not None:
                self._error(row, "low" if low is not None else "high", "one limit only", "give both or none")
            return None
        if "robot" not in self._columns:
            self._findings.repeated_doubt(
                row.place(column),
                "limits are taken as of the value, not of the raw number",
                "multiply them if not",
            )
        return low, high

    def _number(self, row: ListRow, column: str) -> float | None:
        if not row.text(column):
            return None
        return self._read(row, column, lambda text: numbers.real(text, comma=self._comma))

    def _read(self, row: ListRow, column: str, read: Callable[[str], _Read]) -> _Read | None:
        """What a cell holds; None with an error where it holds nothing of the kind."""
        text = row.text(column)
        if not text:
            return None
        try:
            return read(text)
        except NotReadable as refused:
            self._error(row, column, f"`{text[:60]}` cannot be read here", str(refused))
            return None

    def _error(self, row: ListRow, column: str, text: str, hint: str) -> None:
        self._findings.error(row.place(column), text, hint)
