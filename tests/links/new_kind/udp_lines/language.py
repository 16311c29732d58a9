"""The kind's part of the mapping language."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from gatewayd.links.language import LinkLanguage
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLink, ExpandedVariable
from gatewayd.mapping.model import VariableSpec, WriterSpec
from gatewayd.mapping.scalars import Duration, Host, Listen, Name
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import Field

from .declaration import KIND
from .plan import LinesPlan


class Lines(Section):
    """The socket."""

    listen: Listen = Field(description="address and port to take lines at")
    to: Listen = Field(description="address and port to send lines to")
    period: Duration = Field(default=0.02, description="time between two lines")


class LinesPlace(Section):
    """What a variable has."""

    lines: Name | None = Field(default=None, description="its name in lines; default: not in lines")


class LinesWriter(Section):
    """What a writer has."""

    lines: Host | None = Field(default=None, description="address that its lines come from")


@dataclass(frozen=True, slots=True)
class ExpandedLines(ExpandedLink):
    """Variables with their names in lines, and where the file says so."""

    names: tuple[tuple[ExpandedVariable, str, Position], ...]


class LinesLanguage(LinkLanguage):
    """Section `lines`, and the key `lines` of variables and writers."""

    key = KIND.key
    section = Lines
    meaning = "JSON lines over UDP"
    variable_keys = LinesPlace
    writer_keys = LinesWriter
    rules = (f"{__package__}.rules.names",)
    tables = f"{__package__}.tables"
    articles: ClassVar = {Lines: "the section `lines`"}
    writer_example = "lines: 192.0.2.20"
    place_example = "lines: NAME"

    def knows(self, writer: WriterSpec) -> bool:
        """Whether it has an address."""
        return writer.by(LinesWriter).lines is not None

    def names(self, writer: WriterSpec) -> Sequence[str]:
        """The address."""
        host = writer.by(LinesWriter).lines
        return () if host is None else (host,)

    def ways_of_writer(self, writer: WriterSpec) -> frozenset[str]:
        """Lines."""
        return frozenset({"lines"}) if self.knows(writer) else frozenset()

    def ways_of_variable(self, variable: ExpandedVariable, cell: ExpandedCell) -> frozenset[str]:
        """Lines, where the variable has a name in them."""
        return frozenset({"lines"}) if variable.spec.by(LinesPlace).lines else frozenset()

    def places_of(self, line: Part[VariableSpec], document: Document) -> bool:
        """Whether the line has a name."""
        return line.spec.by(LinesPlace).lines is not None

    def expand(self, document: Document, variables: Sequence[ExpandedVariable]) -> ExpandedLines:
        """Names of all variables that have one."""
        found = []
        for variable in variables:
            name = variable.spec.by(LinesPlace).lines
            if name is not None:
                member = "" if variable.member is None else str(variable.member)
                found.append((variable, name + member, variable.at("lines")))
        return ExpandedLines(tuple(found))

    def compile(self, cell: ExpandedCell) -> LinesPlan:
        """One socket."""
        part, expanded = cell.document.part(Lines), cell.link(ExpandedLines)
        assert part is not None
        assert expanded is not None
        hosts = (writer.spec.by(LinesWriter).lines for writer in cell.document.writers.values())
        return LinesPlan(
            (part.spec.listen.host, part.spec.listen.port),
            (part.spec.to.host, part.spec.to.port),
            part.spec.period,
            tuple((variable.index, name) for variable, name, _ in expanded.names),
            tuple((host, index) for index, host in enumerate(hosts) if host is not None),
        )


LANGUAGE = LinesLanguage()
