"""From the tree of a mapping file to its typed parts, each validated by itself.

One bad variable hides no finding of another: a part with errors is left out of the document, and everything
that is wrong with it is reported at its exact place.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any, Final, TypeVar

from gatewayd.links.language import LinkLanguage
from gatewayd.links.registry import languages
from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import Diagnostic, Position, Rule, rule_of
from gatewayd.mapping.document import Document, MappingTest, Part, Step, walk
from gatewayd.mapping.language import FILE, VARIABLE, WRITER
from gatewayd.mapping.model import ANY, FORMAT_VERSION, Group, VariableSpec, WriterSpec
from gatewayd.mapping.scalars import CellName, Name
from gatewayd.mapping.section import Section
from gatewayd.mapping.slips import lookalike
from gatewayd.mapping.source import Items, MappingText, Node, Scalar, Table, TableEntry, shown
from gatewayd.mapping.tables import read
from gatewayd.mapping.testing import StepSpec, TestName
from gatewayd.mapping.typed import Invalid, Mistake
from gatewayd.report.wording import alternatives, number

S = TypeVar("S", bound=Section)
Found = TypeVar("Found")


def read_document(source: MappingText, *, tests: bool = True) -> tuple[Document, tuple[Diagnostic, ...]]:
    """Validate the tree of a file part by part, with its `tests` or without. Never raises."""
    if source.root is None:
        return Document(source, ""), source.findings
    reader = _Reader(source, tests=tests)
    document = reader.read(source.root)
    # What stands in the place of an alias is refused already; that it is no number either helps nobody.
    refused = {finding.position for finding in source.findings}
    further = (finding for finding in reader.findings if finding.position not in refused)
    return document, (*source.findings, *further)


def _node_at(node: Node, path: tuple[Step, ...]) -> Node:
    for step in path:
        if isinstance(node, Table) and isinstance(step, str) and step in node.entries:
            node = node.entries[step].value
        elif isinstance(node, Items) and isinstance(step, int) and step < len(node.items):
            node = node.items[step]
    return node


_NESTED: Final = {where: section for language in languages() for where, section in language.nested.items()}
"""Sections inside sections, by the first step of the path that leads there."""
_ARTICLE: Final[dict[type[Section], str]] = {
    FILE: "the file",
    WriterSpec: "a writer",
    Group: "a group",
    VariableSpec: "a variable",
    StepSpec: "a step",
    **{section: words for language in languages() for section, words in language.articles.items()},
}
_ELSEWHERE: Final[dict[tuple[type[Section], str], str]] = {
    **{
        (FILE, key): f"`{key}` belongs in the section `{language.top_key}`"
        for language in languages()
        for key in language.telling_keys
    },
    **{
        (section, key): f"`{key}` belongs to the writer"
        for section in (VariableSpec, Group)
        for key in ("grace", "timeout", "timeout_counts")
    },
    (VariableSpec, "whole"): "`whole` belongs to the group",
    **{where: hint for language in languages() for where, hint in language.elsewhere.items()},
    **{
        (section, key): f"`{key}` belongs to the variable, beside `{language.key}`"
        for language in languages()
        for section in language.places
        for key in VARIABLE.model_fields
    },
}
"""Keys that people write one table too high or too low."""


def _of(table: Mapping[tuple[type[Section], str], Found], model: type[Section], key: str) -> Found | None:
    """What a table says of a key of a model, be it said of the model itself or of a part that it is made of."""
    known = (table.get((base, key)) for base in model.__mro__)
    return next((found for found in known if found is not None), None)


def _article(model: type[Section]) -> str:
    return next(_ARTICLE[base] for base in model.__mro__ if base in _ARTICLE)


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
_TEXT_HINT = "put it in quotes to make it a text"


class _Reader:
    def __init__(self, source: MappingText, *, tests: bool) -> None:
        self.source = source
        self.tests = tests
        self.findings: list[Diagnostic] = []

    def read(self, root: Table) -> Document:
        self._format_version(root)
        for key, entry in list(root.entries.items()):
            if key not in FILE.model_fields:
                meant = self._unknown_key(FILE, key, entry.key.position)
                if meant not in root.entries:
                    # Read on as what it is meant to be: a slip in one word makes no writer unknown.
                    name = Scalar(meant, quoted=False, position=entry.key.position)
                    root.entries[meant] = TableEntry(name, entry.value)
        for key, described in FILE.model_fields.items():
            if described.is_required() and key != "gatewayd" and key not in root.entries:
                hint = f"add `{key}:`, {described.description}"
                self._find(syntax.MISSING_KEY, f"the key `{key}` is missing", self.source.position(), hint)
        sections = {
            language.key: self._link(language, root) for language in languages() if not language.several
        }
        named = {language.key: self._named(language, root) for language in languages() if language.several}
        return Document(
            self.source,
            self._cell(root.entries.get("cell")),
            {key: part for key, part in sections.items() if part is not None},
            {key: parts for key, parts in named.items() if parts},
            self._sections(WRITER, root.entries.get("writers")),
            self._sections(Group, root.entries.get("groups")),
            self._sections(VARIABLE, root.entries.get("variables")),
            self._tests(root.entries.get("tests")) if self.tests else (),
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
            message = f"{given} is not a version of the mapping language that this gatewayd knows"
            self._find(syntax.FORMAT_VERSION, message, value.position, hint)

    def _cell(self, entry: TableEntry | None) -> str:
        if entry is None or not self._has_value("cell", entry):
            return ""
        try:
            return str(read(CellName, _raw(entry.value)))
        except Invalid as invalid:
            for mistake in invalid.mistakes:
                self._translate(mistake, FILE, entry, ("cell",))
        return ""

    def _sections(self, model: type[S], entry: TableEntry | None) -> dict[str, Part[S]]:
        parts: dict[str, Part[S]] = {}
        for name, inner in self._entries(entry, "write one name with its table per line"):
            named = self._name(model, inner)
            part = self._section(model, inner)
            if named and part is not None:
                parts[name] = part
        return parts

    def _entries(self, entry: TableEntry | None, hint: str) -> list[tuple[str, TableEntry]]:
        if entry is None or not self._has_value(entry.key.text, entry):
            return []
        if not isinstance(entry.value, Table):
            message = f"`{entry.key.text}` is not a table of `name: ...` lines"
            self._find(syntax.WRONG_TYPE, message, entry.value.position, hint)
            return []
        return list(entry.value.entries.items())

    def _tests(self, entry: TableEntry | None) -> tuple[MappingTest, ...]:
        found = [
            self._test(inner) for _name, inner in self._entries(entry, "write a name and its list of steps")
        ]
        return tuple(test for test in found if test is not None)

    def _test(self, entry: TableEntry) -> MappingTest | None:
        """One test; None where any of its steps has a mistake."""
        name = entry.key.text
        if not self._has_value(name, entry):
            return None
        mistakes = len(self.findings)
        self._by_rules_of(TestName, entry)
        if not isinstance(entry.value, Items) or not entry.value.items:
            hint = "write its steps below it, each behind a dash: `- {by: plc, write: {start: true}}`"
            message = f"the test `{shown(name)}` is not a list of steps"
            self._find(syntax.WRONG_TYPE, message, entry.value.position, hint)
            return None
        steps = [
            self._section(
                StepSpec, TableEntry(Scalar(f"step {number}", quoted=True, position=item.position), item)
            )
            for number, item in enumerate(entry.value.items, 1)
        ]
        if len(self.findings) > mistakes:
            return None
        return MappingTest(name, entry.key.position, tuple(step for step in steps if step is not None))

    def _link(self, language: LinkLanguage, root: Table) -> Part[Section] | None:
        part = None
        if language.section is not None:
            part = self._section(language.section, root.entries.get(language.top_key))
        return None if part is None or self._is_broken(language, part) else part

    def _named(self, language: LinkLanguage, root: Table) -> dict[str, Part[Section]]:
        assert language.section is not None
        parts = self._sections(language.section, root.entries.get(language.top_key))
        return {name: part for name, part in parts.items() if not self._is_broken(language, part)}

    def _is_broken(self, language: LinkLanguage, part: Part[Section]) -> bool:
        broken = list(language.broken(part))
        self.findings += broken
        return bool(broken)

    def _name(self, model: type[Section], entry: TableEntry) -> bool:
        if model is WRITER and entry.key.text == ANY:
            message = f"a writer cannot be called `{ANY}`: that word stands for every writer"
            self._find(syntax.BAD_NAME, message, entry.key.position, "choose another name")
            return False
        return self._by_rules_of(Name, entry)

    def _by_rules_of(self, names: Any, entry: TableEntry) -> bool:
        """Whether the key is such a name."""
        try:
            read(names, entry.key.text)
        except Invalid as invalid:
            context = invalid.mistakes[0].context
            self._find(syntax.BAD_NAME, context["message"], entry.key.position, context["hint"])
            return False
        return True

    def _section(self, model: type[S], entry: TableEntry | None) -> Part[S] | None:
        if entry is None or not self._has_value(entry.key.text, entry):
            return None
        found = len(self.findings)
        data = self._data(entry.value)
        try:
            spec = model.model_validate(data)
        except Invalid as invalid:
            for mistake in invalid.mistakes:
                self._translate(mistake, model, entry, ())
            return None
        if len(self.findings) > found:
            return None
        return Part(entry.key.text, spec, entry.key.position, entry.value)

    def _has_value(self, key: str, entry: TableEntry, before: TableEntry | None = None) -> bool:
        if isinstance(entry.value, Scalar) and entry.value.value is None:
            message = f"`{key}` has no value"
            self._find(syntax.WRONG_TYPE, message, entry.key.position, _valueless_hint(entry.key, before))
            return False
        return True

    def _data(self, node: Node) -> Any:
        """Turn a node into what typed tables read; keys without a value are findings and left out."""
        match node:
            case Scalar():
                return node.value
            case Items():
                return [self._data(item) for item in node.items]
            case Table():
                befores = (None, *node.entries.values())
                return {
                    key: self._data(entry.value)
                    for before, (key, entry) in zip(befores, node.entries.items(), strict=False)
                    if self._has_value(key, entry, before)
                }

    def _translate(
        self, mistake: Mistake, model: type[Section], entry: TableEntry, prefix: tuple[Step, ...]
    ) -> None:
        """Make one finding of a mistake."""
        kind, path, context = mistake
        key, value = walk(entry.value, path, entry.key.position)
        rule = rule_of(kind)
        if rule is not None:
            place = key if rule is syntax.MISSING_KEY else value
            self._find(rule, context["message"], place, context["hint"])
            return
        inner = model
        for step in path[:-1]:
            inner = _of(_NESTED, inner, str(step)) or inner
        name = next((step for step in reversed((*prefix, *path)) if isinstance(step, str)), entry.key.text)
        text = _echo(_node_at(entry.value, path))
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
            self._find(syntax.WRONG_TYPE, f"`{name}` is {text}, but must be {_EXPECTED[kind]}", value, hint)
        elif kind in _BOUNDS:
            message = (
                f"`{name}` is {text}, but must be {_BOUNDS[kind][0]} {number(context[_BOUNDS[kind][1]])}"
            )
            self._find(syntax.OUT_OF_RANGE, message, value, _field_hint(inner, name))
        elif kind == "string_pattern_mismatch":
            message = f"{text} is not a host name or IP address"
            host = text.strip("`").partition("//")[2].partition("/")[0]
            self._find(syntax.BAD_NETWORK, message, value, f"write {host or '192.0.2.10'}")
        else:
            message = f"`{name}` is {text}: {_SIZES.get(kind, 'wrong number of values')}"
            self._find(syntax.WRONG_TYPE, message, value, _field_hint(inner, name))

    def _missing_key(self, model: type[Section], path: tuple[Step, ...], entry: TableEntry) -> None:
        key = str(path[-1])
        parent, _ = walk(entry.value, path[:-1], entry.key.position)
        message = f"{_article(model)} needs the key `{key}`"
        self._find(syntax.MISSING_KEY, message, parent, _field_hint(model, key))

    def _unknown_key(self, model: type[Section], key: str, position: Position) -> str:
        """Report it; returns the key that it is most like, or the key itself."""
        message = f"{_article(model)} has no key `{key}`"
        hint = _of(_ELSEWHERE, model, key)
        close = difflib.get_close_matches(key, model.model_fields, n=1, cutoff=0.6) if hint is None else []
        if hint is None:
            hint = f"did you mean `{close[0]}`?" if close else "known keys: " + ", ".join(model.model_fields)
        self._find(syntax.UNKNOWN_KEY, message, position, hint)
        return close[0] if close else key

    def _choice(self, name: str, text: str, expected: str, position: Position) -> None:
        choices = [word.strip("' ") for word in expected.replace(" or ", ",").split(",")]
        written = text.strip("`")
        close = difflib.get_close_matches(written.lower(), [word.lower() for word in choices], n=1)
        match = next((word for word in choices if close and word.lower() == close[0]), None)
        hint = f"did you mean `{match}`?" if match else f"write {alternatives(choices)}"
        synonyms = (language.synonyms.get((name, written.upper())) for language in languages())
        meant = next((word for word in synonyms if word in choices), None)
        if meant is not None:
            hint = f"write {meant} for {written}"
        message = f"`{name}` is {text}, but must be one of {', '.join(choices)}"
        self._find(syntax.BAD_CHOICE, message, position, hint)

    def _find(self, rule: Rule, message: str, position: Position, hint: str) -> None:
        self.findings.append(rule.at(position, message, hint=lookalike(message) or hint))


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


def _valueless_hint(key: Scalar, before: TableEntry | None) -> str:
    """Four slips of the pen look like a key without a value; a character that only looks right is one more."""
    name, colon, rest = key.text.partition(":")
    if colon:
        return f"write `{name}: {rest}`, with a space after the colon"
    beside = before is not None and before.key.position.line == key.position.line
    bracketed = ""
    if beside and before is not None and isinstance(before.value, Scalar):
        bracketed = f"a list needs brackets: `{before.key.text}: [{before.value.text}, {key.text}]`"
    if key.text.isascii() and key.text.isdigit():
        point = "a comma ends a value: in a number write a point, such as 0.1 or 100.3"
        return f"{point}; {bracketed}" if bracketed else point
    return bracketed or "write a value, or remove the key; what belongs to it is indented below it"


def _raw(node: Node) -> Any:
    return node.value if isinstance(node, Scalar) else {} if isinstance(node, Table) else []


def _echo(node: Node) -> str:
    """Return a value as a message echoes it."""
    match node:
        case Scalar():
            return f"`{shown(node.text)}`"
        case Items():
            return f"a list of {len(node.items)}"
        case Table():
            return "a table"
