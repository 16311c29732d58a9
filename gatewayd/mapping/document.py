"""From the tree of a mapping file to its typed parts, each validated by itself.

One bad variable hides no finding of another: a part with errors is left out of the document, and everything
that is wrong with it is reported at its exact place.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from gatewayd.links.canopen_node.sections import (
    AUTO,
    NO_PDO,
    Canopen,
    CanopenPlace,
    CobIdPool,
    PdoDefaults,
    PdoSpec,
    Sync,
)
from gatewayd.links.modbus_server.sections import Modbus, PlacementSpec
from gatewayd.links.robot.sections import Robot, Watchdog
from gatewayd.mapping.diagnostics import Diagnostic, Position, Rule
from gatewayd.mapping.model import ANY, FORMAT_VERSION, Group, MappingFile, VariableSpec, WriterSpec
from gatewayd.mapping.rules import syntax
from gatewayd.mapping.scalars import CellName, Name
from gatewayd.mapping.section import Section
from gatewayd.mapping.source import Entry, Items, Node, Scalar, Source, Table

__all__ = ["Document", "Part", "read_document"]

S = TypeVar("S", bound=Section)
Step = str | int


@dataclass(frozen=True, slots=True)
class Part(Generic[S]):
    """A valid section of the file and where it stands."""

    name: str
    """Key it stands under: `robot`, or the name of the writer, group or variable."""
    spec: S
    key: Position
    """Place of the key."""
    node: Node

    def at(self, *path: Step) -> Position:
        """Return the place of the value at `path`, or of the nearest thing around it; without path, of the key."""
        return _walk(self.node, path, self.key)[1] if path else self.key

    def key_at(self, *path: Step) -> Position:
        """Return the place of the key at `path`, or of the nearest key around it."""
        return _walk(self.node, path, self.key)[0]


@dataclass(frozen=True, slots=True)
class Document:
    """What could be read of a mapping file."""

    source: Source
    cell: str
    """Name of the cell; empty when it is missing or wrong."""
    robot: Part[Robot] | None = None
    modbus: Part[Modbus] | None = None
    canopen: Part[Canopen] | None = None
    writers: Mapping[str, Part[WriterSpec]] = field(default_factory=dict)
    groups: Mapping[str, Part[Group]] = field(default_factory=dict)
    variables: Mapping[str, Part[VariableSpec]] = field(default_factory=dict)

    def declared(self, section: str) -> frozenset[str]:
        """Return the keys that stand in a top-level table, the broken ones too."""
        root = self.source.root
        entry = root.entries.get(section) if root is not None else None
        return (
            frozenset(entry.value.entries)
            if entry is not None and isinstance(entry.value, Table)
            else frozenset()
        )

    def has(self, section: str) -> bool:
        """Whether the file holds a top-level key, be it right or wrong."""
        return self.source.root is not None and section in self.source.root.entries

    def at(self, *path: Step) -> Position:
        """Return the place of the value at `path` from the top of the file, or of the nearest thing around it."""
        start = self.source.position()
        return _walk(self.source.root, path, start)[1] if self.source.root is not None else start

    def key_at(self, *path: Step) -> Position:
        """Return the place of the key at `path` from the top of the file, or of the nearest key around it."""
        start = self.source.position()
        return _walk(self.source.root, path, start)[0] if self.source.root is not None else start


def read_document(source: Source) -> tuple[Document, tuple[Diagnostic, ...]]:
    """Validate the tree of a file part by part. Never raises."""
    if source.root is None:
        return Document(source, ""), source.findings
    reader = _Reader(source)
    document = reader.read(source.root)
    # What stands in the place of an alias is refused already; that it is no number either helps nobody.
    refused = {finding.position for finding in source.findings}
    further = (finding for finding in reader.findings if finding.position not in refused)
    return document, (*source.findings, *further)


def _walk(node: Node, path: tuple[Step, ...], key: Position) -> tuple[Position, Position]:
    """Follow `path` as far as it leads; return the places of the last key and of its value."""
    value = node.position
    for step in path:
        if isinstance(node, Table) and isinstance(step, str) and step in node.entries:
            entry = node.entries[step]
            key, node = entry.key.position, entry.value
            value = node.position
        elif isinstance(node, Items) and isinstance(step, int) and step < len(node.items):
            node = node.items[step]
            value = key = node.position
    return key, value


def _node_at(node: Node, path: tuple[Step, ...]) -> Node:
    for step in path:
        if isinstance(node, Table) and isinstance(step, str) and step in node.entries:
            node = node.entries[step].value
        elif isinstance(node, Items) and isinstance(step, int) and step < len(node.items):
            node = node.items[step]
    return node


_NESTED: dict[tuple[type[Section], str], type[Section]] = {
    (Robot, "watchdog"): Watchdog,
    (VariableSpec, "modbus"): PlacementSpec,
    (VariableSpec, "canopen"): CanopenPlace,
    (Canopen, "sync"): Sync,
    (Canopen, "pdo"): PdoDefaults,
    (Canopen, "cob_ids"): CobIdPool,
    (Canopen, "pdos"): PdoSpec,
}
"""Sections inside sections, by the first step of the path that leads there."""
_ARTICLE: dict[type[Section], str] = {
    MappingFile: "the file",
    Robot: "the section `robot`",
    Modbus: "the section `modbus`",
    WriterSpec: "a writer",
    Group: "a group",
    VariableSpec: "a variable",
    PlacementSpec: "a placement in `modbus`",
    Watchdog: "the watchdog",
    Canopen: "the section `canopen`",
    CanopenPlace: "`canopen` of a variable",
    Sync: "the table `sync`",
    PdoDefaults: "the table `pdo`",
    CobIdPool: "the table `cob_ids`",
    PdoSpec: "a PDO",
}
_ELSEWHERE: dict[tuple[type[Section], str], str] = {
    **{
        (VariableSpec, key): f"`{key}` belongs to the placement: modbus: {{holding: 100, {key}: ...}}"
        for key in ("type", "order", "scale", "offset", "holding", "input", "coil", "discrete")
    },
    **{
        (PlacementSpec, key): f"`{key}` belongs to the variable, beside `modbus`"
        for key in VariableSpec.model_fields
    },
    **{
        (MappingFile, key): f"`{key}` belongs into the section `robot`"
        for key in ("host", "frequency", "port", "series", "version", "adopt_for", "valid")
    },
    (VariableSpec, "whole"): "`whole` belongs to the group",
    **{
        (section, key): f"`{key}` belongs to the writer"
        for section in (VariableSpec, Group, Modbus)
        for key in ("grace", "timeout", "timeout_counts")
    },
    **{
        (MappingFile, key): f"`{key}` belongs into the section `modbus`"
        for key in ("listen", "unit", "allow")
    },
    **{
        (MappingFile, key): f"`{key}` belongs into the section `canopen`"
        for key in ("channel", "bitrate", "node", "pdos")
    },
}
_EXPECTED = {
    "int_type": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "string_type": "a text",
    "model_type": "a table of `key: value`",
    "dict_type": "a table of `key: value`",
    "tuple_type": "a list",
    "list_type": "a list",
}
_TEXT_HINT = "put it into quotes to make it a text"
_NAME_READER: TypeAdapter[str] = TypeAdapter(Name)
_CELL_READER: TypeAdapter[str] = TypeAdapter(CellName)


class _Reader:
    def __init__(self, source: Source) -> None:
        self.source = source
        self.findings: list[Diagnostic] = []
        self._named: dict[type[Section], dict[str, Part[Any]]] = {}

    def read(self, root: Table) -> Document:
        self._format_version(root)
        for key, entry in root.entries.items():
            if key not in MappingFile.model_fields:
                self._unknown_key(MappingFile, key, entry.key.position)
        for key in ("cell", "robot", "variables"):
            if key not in root.entries:
                hint = f"add `{key}:`, {MappingFile.model_fields[key].description}"
                self._find(syntax.MISSING_KEY, f"the key `{key}` is missing", self.source.position(), hint)
        return Document(
            self.source,
            self._cell(root.entries.get("cell")),
            self._section(Robot, root.entries.get("robot")),
            self._section(Modbus, root.entries.get("modbus")),
            self._canopen(root.entries.get("canopen")),
            self._sections(WriterSpec, root.entries.get("writers")),
            self._sections(Group, root.entries.get("groups")),
            self._sections(VariableSpec, root.entries.get("variables")),
        )

    def _format_version(self, root: Table) -> None:
        hint = f"write `gatewayd: {FORMAT_VERSION}` in the first lines"
        entry = root.entries.get("gatewayd")
        if entry is None:
            message = "the key `gatewayd` with the version of the mapping language is missing"
            self._find(syntax.FORMAT_VERSION, message, self.source.position(), hint)
            return
        value = entry.value
        if not isinstance(value, Scalar) or value.quoted or value.text != str(FORMAT_VERSION):
            given = f"`{value.text}`" if isinstance(value, Scalar) else "this"
            message = f"{given} is no version of the mapping language that this gatewayd knows"
            self._find(syntax.FORMAT_VERSION, message, value.position, hint)

    def _cell(self, entry: Entry | None) -> str:
        if entry is None or not self._has_value("cell", entry):
            return ""
        try:
            return _CELL_READER.validate_python(_raw(entry.value))
        except ValidationError as error:
            for details in error.errors(include_url=False):
                self._translate(details, MappingFile, entry, ("cell",))
        return ""

    def _sections(self, model: type[S], entry: Entry | None) -> dict[str, Part[S]]:
        parts: dict[str, Part[S]] = {}
        if entry is None or not self._has_value(entry.key.text, entry):
            return parts
        if not isinstance(entry.value, Table):
            message = f"`{entry.key.text}` is not a table of `name: ...` lines"
            self._find(
                syntax.WRONG_TYPE, message, entry.value.position, "write one name with its table per line"
            )
            return parts
        for name, inner in entry.value.entries.items():
            named = self._name(model, inner)
            part = self._section(model, inner)
            if named and part is not None:
                parts[name] = part
        return parts

    def _canopen(self, entry: Entry | None) -> Part[Canopen] | None:
        part = self._section(Canopen, entry)
        reserved = [name for name in (AUTO, NO_PDO) if part is not None and name in part.spec.pdos]
        for name in reserved:
            assert part is not None
            message = f"a PDO cannot be called `{name}`: the word has a meaning of its own"
            self._find(syntax.BAD_NAME, message, part.key_at("pdos", name), "choose another name")
        return None if reserved else part

    def _name(self, model: type[Section], entry: Entry) -> bool:
        if model is WriterSpec and entry.key.text == ANY:
            message = f"a writer cannot be called `{ANY}`: that word stands for every writer"
            self._find(syntax.BAD_NAME, message, entry.key.position, "choose another name")
            return False
        try:
            _NAME_READER.validate_python(entry.key.text)
        except ValidationError as error:
            details = error.errors(include_url=False)[0]
            context = details.get("ctx", {})
            self._find(syntax.BAD_NAME, context["message"], entry.key.position, context["hint"])
            return False
        return True

    def _section(self, model: type[S], entry: Entry | None) -> Part[S] | None:
        if entry is None or not self._has_value(entry.key.text, entry):
            return None
        found = len(self.findings)
        data = self._data(entry.value)
        try:
            spec = model.model_validate(data)
        except ValidationError as error:
            for details in error.errors(include_url=False):
                self._translate(details, model, entry, ())
            return None
        return (
            Part(entry.key.text, spec, entry.key.position, entry.value)
            if len(self.findings) == found
            else None
        )

    def _has_value(self, key: str, entry: Entry) -> bool:
        if isinstance(entry.value, Scalar) and entry.value.value is None:
            message = f"`{key}` has no value"
            self._find(syntax.WRONG_TYPE, message, entry.key.position, _valueless_hint(key))
            return False
        return True

    def _data(self, node: Node) -> Any:
        """Turn a node into what pydantic reads; keys without a value are findings and left out."""
        match node:
            case Scalar():
                return node.value
            case Items():
                return [self._data(item) for item in node.items]
            case Table():
                return {
                    key: self._data(entry.value)
                    for key, entry in node.entries.items()
                    if self._has_value(key, entry)
                }

    def _translate(
        self, details: ErrorDetails, model: type[Section], entry: Entry, prefix: tuple[Step, ...]
    ) -> None:
        """Make one finding of a pydantic error."""
        path = details["loc"]
        key, value = _walk(entry.value, path, entry.key.position)
        kind, context = details["type"], details.get("ctx", {})
        rule = _CUSTOM.get(kind)
        if rule is not None:
            place = key if rule is syntax.MISSING_KEY else value
            self._find(rule, context["message"], place, context["hint"])
            return
        inner = _NESTED.get((model, str(path[0])), model) if len(path) > 1 else model
        name = str(
            next((step for step in reversed((*prefix, *path)) if isinstance(step, str)), entry.key.text)
        )
        text = _shown(_node_at(entry.value, path))
        if kind == "missing" and isinstance(path[-1], str):
            self._missing_key(inner, path, entry)
        elif kind == "extra_forbidden":
            self._unknown_key(inner, name, key)
        elif kind == "literal_error":
            self._choice(name, text, context["expected"], value)
        elif kind in _EXPECTED:
            hint = _TEXT_HINT if kind == "string_type" else f"write {_EXPECTED[kind]}"
            if name == "limits":
                hint = "write [least, greatest], for example [0, 150]"
            self._find(syntax.WRONG_TYPE, f"`{name}` is {text}, expected is {_EXPECTED[kind]}", value, hint)
        elif kind in _BOUNDS:
            message = f"`{name}` is {text}, it must be {_BOUNDS[kind][0]} {context[_BOUNDS[kind][1]]}"
            self._find(syntax.OUT_OF_RANGE, message, value, _field_hint(inner, name))
        elif kind == "string_pattern_mismatch":
            self._find(
                syntax.BAD_NETWORK, f"{text} is not a host name or IP address", value, "write 192.168.1.10"
            )
        else:
            message = f"`{name}` is {text}: {_SIZES.get(kind, 'wrong number of values')}"
            self._find(syntax.WRONG_TYPE, message, value, _field_hint(inner, name))

    def _missing_key(self, model: type[Section], path: tuple[Step, ...], entry: Entry) -> None:
        key = str(path[-1])
        parent, _ = _walk(entry.value, path[:-1], entry.key.position)
        message = f"{_ARTICLE[model]} needs the key `{key}`"
        self._find(syntax.MISSING_KEY, message, parent, _field_hint(model, key))

    def _unknown_key(self, model: type[Section], key: str, position: Position) -> None:
        message = f"{_ARTICLE[model]} has no key `{key}`"
        hint = _ELSEWHERE.get((model, key))
        if hint is None:
            close = difflib.get_close_matches(key, model.model_fields, n=1, cutoff=0.6)
            hint = f"did you mean `{close[0]}`?" if close else "known keys: " + ", ".join(model.model_fields)
        self._find(syntax.UNKNOWN_KEY, message, position, hint)

    def _choice(self, name: str, text: str, expected: str, position: Position) -> None:
        choices = [word.strip("' ") for word in expected.replace(" or ", ",").split(",")]
        close = difflib.get_close_matches(text.strip("`").lower(), [word.lower() for word in choices], n=1)
        match = next((word for word in choices if close and word.lower() == close[0]), None)
        iec = _IEC_TYPES.get(text.strip("`").upper()) if name == "type" else None
        hint = f"did you mean `{match}`?" if match else f"write {', '.join(choices)}"
        if iec in choices:
            hint = f"write {iec}: that is {text.strip('`').upper()} here"
        self._find(
            syntax.BAD_CHOICE, f"`{name}` is {text}, it must be one of {', '.join(choices)}", position, hint
        )

    def _find(self, rule: Rule, message: str, position: Position, hint: str) -> None:
        self.findings.append(rule.at(position, message, hint=hint))


_CUSTOM = {
    rule.slug: rule
    for rule in (
        syntax.BAD_ADDRESS,
        syntax.BAD_CHOICE,
        syntax.BAD_COB_ID,
        syntax.BAD_DURATION,
        syntax.BAD_NAME,
        syntax.BAD_NETWORK,
        syntax.BAD_NUMBER,
        syntax.BAD_RANGE,
        syntax.BAD_REFERENCE,
        syntax.MISSING_KEY,
        syntax.OUT_OF_RANGE,
        syntax.WRONG_TYPE,
    )
}
_IEC_TYPES = {
    "BOOL": "bit",
    "INT": "int16",
    "UINT": "uint16",
    "WORD": "uint16",
    "DINT": "int32",
    "UDINT": "uint32",
    "DWORD": "uint32",
    "LINT": "int64",
    "ULINT": "uint64",
    "LWORD": "uint64",
    "REAL": "float32",
    "LREAL": "float64",
}
"""What the types of IEC 61131-3, which every PLC programmer has in the fingers, are called here."""
_BOUNDS = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_SIZES = {
    "too_short": "not enough values",
    "too_long": "too many values",
    "missing": "not enough values",
    "string_too_short": "it must not be empty",
    "string_too_long": "too long",
}


def _field_hint(model: type[Section], key: str) -> str:
    known = model.model_fields.get(key)
    return f"`{key}`: {known.description}" if known is not None else "see the mapping reference"


def _valueless_hint(key: str) -> str:
    """Three slips of the pen look like a key without a value."""
    if key.isascii() and key.isdigit():
        return "a comma ends a value: in a number write a point, such as 0.1 or 100.3"
    if not key.isprintable():
        return "there is an invisible character in it, most often a no-break space: type the line anew"
    name, colon, rest = key.partition(":")
    if colon:
        return f"write `{name}: {rest}`, with a space after the colon"
    return "write a value, or remove the key; what belongs to it is indented below it"


def _raw(node: Node) -> Any:
    return node.value if isinstance(node, Scalar) else {} if isinstance(node, Table) else []


_SHOWN_LENGTH = 60


def _shown(node: Node) -> str:
    """Return a value as a message echoes it."""
    match node:
        case Scalar():
            text = node.text if len(node.text) <= _SHOWN_LENGTH else node.text[: _SHOWN_LENGTH - 3] + "..."
            return f"`{text}`"
        case Items():
            return f"a list of {len(node.items)}"
        case Table():
            return "a table"
