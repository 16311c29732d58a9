"""A mapping file as typed parts, each of which knows where it stands.

`gatewayd.mapping.reader` makes it of a tree. A part with errors is left out of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeAlias, TypeVar, cast

from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.model import Group, VariableSpec, WriterSpec
from gatewayd.mapping.section import Section
from gatewayd.mapping.source import Items, MappingText, Node, Table
from gatewayd.mapping.testing import StepSpec

S_co = TypeVar("S_co", bound=Section, covariant=True)
Other = TypeVar("Other", bound=Section)
Step: TypeAlias = str | int


@dataclass(frozen=True, slots=True)
class Part(Generic[S_co]):
    """A valid section of the file and where it stands."""

    name: str
    """Key it stands under: `robot`, or the name of the writer, group or variable."""
    spec: S_co
    key: Position
    """Place of the key."""
    node: Node

    def of(self, section: type[Other]) -> Part[Other] | None:
        """The same for who knows its type; None where it is another."""
        return cast("Part[Other]", self) if isinstance(self.spec, section) else None

    def at(self, *path: Step) -> Position:
        """Return the place of the value at `path`, or of the nearest thing around it; without path, of the key."""
        return walk(self.node, path, self.key)[1] if path else self.key

    def key_at(self, *path: Step) -> Position:
        """Return the place of the key at `path`, or of the nearest key around it."""
        return walk(self.node, path, self.key)[0]


@dataclass(frozen=True, slots=True)
class MappingTest:
    """One test of a mapping file."""

    name: str
    position: Position
    """Place of the name."""
    steps: tuple[Part[StepSpec], ...]

    @property
    def seconds(self) -> float:
        """Simulated time that its steps take."""
        return sum((step.spec.after or 0.0) + (step.spec.repeat_for or 0.0) for step in self.steps)


@dataclass(frozen=True, slots=True)
class Document:
    """What could be read of a mapping file."""

    source: MappingText
    cell: str
    """Name of the cell; empty when it is missing or wrong."""
    sections: Mapping[str, Part[Section]] = field(default_factory=dict)
    """Those of the kinds of links, by key."""
    named: Mapping[str, Mapping[str, Part[Section]]] = field(default_factory=dict)
    """Of kinds whose section is a table of names (`LinkLanguage.several`), by key of the kind: its parts by name."""
    writers: Mapping[str, Part[WriterSpec]] = field(default_factory=dict)
    groups: Mapping[str, Part[Group]] = field(default_factory=dict)
    variables: Mapping[str, Part[VariableSpec]] = field(default_factory=dict)
    tests: tuple[MappingTest, ...] = ()
    """Empty too where they were not to be read."""

    def part(self, section: type[Other]) -> Part[Other] | None:
        """The section of that type; None where there is none, or a broken one."""
        found = (part.of(section) for part in self.sections.values())
        return next((part for part in found if part is not None), None)

    def parts(self, section: type[Other]) -> Mapping[str, Part[Other]]:
        """The sections of that type by name, of a kind that has several; without the broken ones."""
        found = {name: part.of(section) for parts in self.named.values() for name, part in parts.items()}
        return {name: part for name, part in found.items() if part is not None}

    def declared(self, section: str) -> frozenset[str]:
        """Return the keys that stand in a top-level table, the broken ones too."""
        root = self.source.root
        entry = root.entries.get(section) if root is not None else None
        found = entry.value if entry is not None else None
        return frozenset(found.entries if isinstance(found, Table) else ())

    def has(self, section: str) -> bool:
        """Whether the file holds a top-level key, be it right or wrong."""
        return self.source.root is not None and section in self.source.root.entries

    def at(self, *path: Step) -> Position:
        """Return the place of the value at `path` from the top of the file, or of the nearest thing around it."""
        return self._places(path)[1]

    def key_at(self, *path: Step) -> Position:
        """Return the place of the key at `path` from the top of the file, or of the nearest key around it."""
        return self._places(path)[0]

    def _places(self, path: tuple[Step, ...]) -> tuple[Position, Position]:
        start = self.source.position()
        return walk(self.source.root, path, start) if self.source.root is not None else (start, start)


def walk(node: Node, path: tuple[Step, ...], key: Position) -> tuple[Position, Position]:
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
