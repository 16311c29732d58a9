"""The text of a mapping file as a tree in which every key and value knows its place.

The only module that knows ruamel.yaml. It reads YAML 1.2 and keeps the text of each scalar, so that `0.10`
stays bit 10 of register 0. `parse` never raises, whatever the bytes: what is wrong comes back as findings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)
from ruamel.yaml.reader import ReaderError

from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule
from gatewayd.mapping.slips import slip_in, strange_indent

MAX_BYTES: Final = 1 << 20
"""Greatest size of a mapping file."""
MAX_DEPTH: Final = 16
"""Greatest nesting of tables and lists; a mapping needs five."""

_BEGIN: Final = "begin with `gatewayd: 1`"
_SHOWN_LENGTH: Final = 60
_WHOLE = re.compile(r"[-+]?[0-9]{1,300}|0x[0-9a-fA-F]{1,240}|0o[0-7]{1,300}")
_REAL = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NAMED: Final[dict[str, Any]] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **{sign + word: float(sign + "inf") for sign in ("", "+", "-") for word in (".inf", ".Inf", ".INF")},
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}


class WholeNumber(int):
    """An integer that remembers how it was written."""

    text: str


class RealNumber(float):
    """A real that remembers how it was written: `0.10` is not `0.1` where an address is meant."""

    text: str


@dataclass(frozen=True, slots=True)
class Scalar:
    """A text, number, truth value or nothing."""

    text: str
    """As written, without quotes."""
    quoted: bool
    """Quoted or a block scalar: always a text."""
    position: Position

    @property
    def value(self) -> str | int | float | bool | None:
        """What the YAML 1.2 core schema makes of it."""
        return self.text if self.quoted else _resolve(self.text)


@dataclass(frozen=True, slots=True)
class TableEntry:
    """One `key: value` of a table."""

    key: Scalar
    value: Node


@dataclass(frozen=True, slots=True)
class Table:
    """A YAML mapping, in file order; of a repeated key only the first entry."""

    position: Position
    entries: dict[str, TableEntry] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Items:
    """A YAML sequence."""

    position: Position
    items: list[Node] = field(default_factory=list)


Node: TypeAlias = Scalar | Table | Items


@dataclass(frozen=True, slots=True)
class MappingText:
    """One mapping file, read."""

    name: str
    """Path as given."""
    root: Table | None
    """None when the file is no table or could not be read to its end."""
    findings: tuple[Diagnostic, ...]
    lines: tuple[str, ...] = ()
    """Text of the file by line, for excerpts."""

    def position(self) -> Position:
        """Return the start of the file, for what is missing altogether."""
        return Position(self.name, 1, 1)


def parse(data: bytes, name: str) -> MappingText:
    """Read the bytes of a mapping file; `name` is the path that positions show.

    Never raises. Syntax errors, wrong encodings, and the parts of YAML that a mapping may not use become
    findings.
    """
    if len(data) > MAX_BYTES:
        message = f"the file has more than {MAX_BYTES} bytes"
        hint = "one file describes one robot cell"
        return MappingText(name, None, (syntax.TOO_LARGE.at(Position(name, 1, 1), message, hint=hint),))
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return MappingText(name, None, (_not_utf8(data, error, name),))
    reader = _Reader(name)
    root = reader.read(text)
    return MappingText(name, root, tuple(reader.findings), tuple(text.splitlines()))


_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_UTF16_HINT = "this is UTF-16, which Windows calls Unicode: save the file with the encoding UTF-8"


def _not_utf8(data: bytes, error: UnicodeDecodeError, name: str) -> Diagnostic:
    before = data[: error.start]
    line = before.count(b"\n") + 1
    column = len(before[before.rfind(b"\n") + 1 :].decode("utf-8", "replace")) + 1
    return syntax.NOT_UTF8.at(
        Position(name, line, column),
        f"byte 0x{data[error.start]:02X} is not UTF-8 text",
        hint=_UTF16_HINT if data[:2] in _UTF16_MARKS else "save the file with the encoding UTF-8",
    )


def _resolve(text: str) -> str | int | float | bool | None:
    if text in _NAMED:
        return _NAMED[text]  # type: ignore[no-any-return]
    if _WHOLE.fullmatch(text):
        # A leading 0 does not make a number octal in YAML 1.2.
        base = {"0x": 16, "0o": 8}.get(text[:2], 10)
        whole = WholeNumber(text, base)
        whole.text = text
        return whole
    if _REAL.fullmatch(text):
        real = RealNumber(text)
        real.text = text
        return real
    return text


class _Reader:
    """Builds the tree from YAML events; gives up at the first error that makes the rest unreadable."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.findings: list[Diagnostic] = []
        self._anchors: dict[str, Position] = {}
        self._lines: list[str] = []

    def read(self, text: str) -> Table | None:
        self._lines = text.splitlines()
        try:
            root = self._document(YAML(typ="safe", pure=True).parse(text))
        except _TooDeepError as error:
            message = f"tables or lists are nested more than {MAX_DEPTH} deep"
            self._find(syntax.TOO_LARGE, message, error.position, "a mapping needs no more than five levels")
            return None
        except _SlipError as error:
            self._find(syntax.YAML_SYNTAX, error.message, error.position, error.hint)
            return None
        except MarkedYAMLError as error:
            self._syntax(error)
            return None
        except ReaderError as error:
            self._unprintable(text, error.position)
            return None
        except YAMLError as error:
            self._find(syntax.YAML_SYNTAX, _one_line(str(error)), Position(self.name, 1, 1), "")
            return None
        except Exception as error:  # noqa: BLE001 - a defect of the YAML library must not end as a traceback
            message = f"the file cannot be read as YAML ({type(error).__name__})"
            self._find(syntax.YAML_SYNTAX, message, Position(self.name, 1, 1), "")
            return None
        if isinstance(root, Table):
            return root
        if root is None or (isinstance(root, Scalar) and root.value is None):
            message = "the file holds no mapping"
            self._find(syntax.EMPTY, message, Position(self.name, 1, 1), _BEGIN)
        else:
            self._find(
                syntax.WRONG_TYPE, "the file is not a table of `key: value` lines", root.position, _BEGIN
            )
        return None

    def _document(self, events: Iterator[Any]) -> Node | None:
        root: Node | None = None
        documents = 0
        for event in events:
            if isinstance(event, StreamEndEvent):
                break
            if isinstance(event, DocumentStartEvent):
                documents += 1
                if documents > 1:
                    hint = "one file describes one cell: split the file at `---`"
                    message = "a second YAML document begins here"
                    self._find(syntax.SEVERAL_DOCUMENTS, message, self._at(event), hint)
                    break
                if event.version is not None or event.tags:
                    message = "YAML directives (`%...`) are not used in mappings"
                    self._find(syntax.TAG, message, self._at(event), "remove the line")
            elif isinstance(event, (ScalarEvent, MappingStartEvent, SequenceStartEvent, AliasEvent)):
                root = self._node(event, events, 0)
        return root

    def _node(self, event: Any, events: Iterator[Any], depth: int) -> Node:
        position = self._at(event)
        if depth > MAX_DEPTH:
            raise _TooDeepError(position)
        self._refuse_decorations(event, position)
        if isinstance(event, AliasEvent):
            return self._alias(event, position)
        if isinstance(event, ScalarEvent):
            return Scalar(event.value, bool(event.style), position)
        if isinstance(event, SequenceStartEvent):
            items = Items(position)
            while not isinstance(event := next(events), SequenceEndEvent):
                items.items.append(self._node(event, events, depth + 1))
            return items
        table = Table(position)
        while not isinstance(event := next(events), MappingEndEvent):
            key = self._node(event, events, depth + 1)
            value = self._node(next(events), events, depth + 1)
            self._enter(table, key, value)
        return table

    def _enter(self, table: Table, key: Node, value: Node) -> None:
        if not isinstance(key, Scalar):
            message = "a key must be a plain text, not a list or a table"
            self._find(syntax.BAD_NAME, message, key.position, "quote it, or write `key: value`")
        elif not key.quoted and (slip := strange_indent(key.text)) is not None:
            raise _SlipError(key.position, *slip)
        elif key.text == "<<" and not key.quoted:
            message = "merge keys (`<<`) are not used in mappings"
            self._find(syntax.ALIAS, message, key.position, "write the keys out")
        elif (first := table.entries.get(key.text)) is not None:
            related = (Related(first.key.position, "first given here"),)
            message = f"the key `{shown(key.text)}` is given twice in one table"
            self._find(syntax.DUPLICATE_KEY, message, key.position, "remove one of the two", related)
        else:
            table.entries[key.text] = TableEntry(key, value)

    def _refuse_decorations(self, event: Any, position: Position) -> None:
        if isinstance(event, AliasEvent):
            return
        if event.anchor is not None:
            self._anchors.setdefault(event.anchor, position)
            message = f"anchors (`&{shown(event.anchor)}`) are not used in mappings"
            self._find(syntax.ALIAS, message, position, "write the value out where it is needed")
        if event.ctag is not None:
            message = f"tags (`{shown(str(event.ctag))}`) are not used in mappings"
            hint = "types follow from the place of a value: remove the tag"
            self._find(syntax.TAG, message, position, hint)

    def _alias(self, event: Any, position: Position) -> Scalar:
        anchor = self._anchors.get(event.anchor)
        related = (Related(anchor, "the anchor is here"),) if anchor is not None else ()
        message = f"aliases (`*{shown(event.anchor)}`) are not used in mappings"
        self._find(syntax.ALIAS, message, position, "write the value out", related)
        return Scalar("*" + event.anchor, quoted=True, position=position)

    def _syntax(self, error: MarkedYAMLError) -> None:
        mark = error.problem_mark or error.context_mark
        position = self._position(mark) if mark else Position(self.name, 1, 1)
        related: tuple[Related, ...] = ()
        if error.context and error.context_mark and mark is not error.context_mark:
            context = _one_line(error.context)
            related = (Related(self._position(error.context_mark), _CONTEXTS.get(context, context)),)
        if error.context_mark is not None or "mapping values" in (error.problem or ""):
            first = self._position(error.context_mark).line if error.context_mark else position.line - 1
            slip = slip_in(self._lines, max(first, position.line - 2, 1), position.line)
            if slip is not None:
                place = Position(self.name, slip.line, slip.column)
                self._find(syntax.YAML_SYNTAX, slip.message, place, slip.hint)
                return
        problem = _one_line(error.problem or error.context or "not YAML")
        problem = problem.replace("'<stream end>'", "the end of the file")
        if problem.startswith("expected <block end>"):
            problem = "the indentation of this line fits none of the lines above"
        rest = self._lines[position.line - 1 : position.line]
        hint = _syntax_hint(problem, rest[0][position.column - 1 :] if rest else "")
        self._find(syntax.YAML_SYNTAX, problem, position, hint, related)

    def _unprintable(self, text: str, offset: int) -> None:
        lines = text[: offset + 1].splitlines()
        position = Position(self.name, len(lines), len(lines[-1]) or 1)
        message = f"the character U+{ord(text[offset]):04X} does not belong in a text file"
        self._find(
            syntax.NOT_UTF8, message, position, "delete it; the file may have been saved in a wrong encoding"
        )

    def _find(
        self, rule: Rule, message: str, position: Position, hint: str, related: tuple[Related, ...] = ()
    ) -> None:
        self.findings.append(rule.at(position, message, hint=hint or None, related=related))

    def _at(self, event: Any) -> Position:
        return self._position(event.start_mark)

    def _position(self, mark: Any) -> Position:
        return Position(self.name, mark.line + 1, mark.column + 1)


_COMMENTS: Final = ("//", "(*", "/*", ";")
_CONTEXTS: Final = {
    "while parsing a flow sequence": "the list `[` begins here",
    "while parsing a flow mapping": "the table `{` begins here",
    "while parsing a block mapping": "the table begins here",
    "while parsing a block collection": "the list begins here",
    "while scanning a quoted scalar": "the quoted text begins here",
}


class _SlipError(Exception):
    def __init__(self, position: Position, message: str, hint: str) -> None:
        super().__init__()
        self.position, self.message, self.hint = position, message, hint


class _TooDeepError(Exception):
    def __init__(self, position: Position) -> None:
        super().__init__()
        self.position = position


def _syntax_hint(problem: str, rest: str) -> str:
    """What to do, from the parser's words and the rest of the line where it stopped."""
    if rest.startswith(_COMMENTS):
        return "a comment begins with # and a space in front of it"
    if "\\t" in problem:
        return "indent with spaces, never with tabs"
    if "but got '['" in problem:
        return "put quotes around what has brackets: robot: 'actual_TCP_pose[2]'"
    if "but got ':'" in problem:
        return "a comma or a closing bracket is missing before this place; a text that contains `: ` needs quotes"
    if "':'" in problem or "mapping values" in problem:
        return "write `key: value` with a space after the colon, and quote texts that contain `: `"
    if "'%'" in problem:
        return "no value begins with %: an address is a number from 0, for example 100 or 100.3"
    return "compare the indentation and the brackets with the lines above"


def _one_line(text: str) -> str:
    return " ".join(text.split())[:200]


def shown(text: str) -> str:
    """The text as a message echoes it: not all of a very long one."""
    return text if len(text) <= _SHOWN_LENGTH else text[: _SHOWN_LENGTH - 3] + "..."
