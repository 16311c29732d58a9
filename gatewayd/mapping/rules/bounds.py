"""Rules GW119, GW124 and GW221: how much one cell holds, what tells cells apart, and what nobody can see."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gatewayd.links.registry import definer, languages
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule, plant_rule
from gatewayd.report.wording import alternatives

MAX_VARIABLES = 1024
"""The status block has a quality bit and an owner word for so many."""
MAX_WRITERS = 32
"""The status block has a record for so many."""


@cell_rule("GW119")
def too_many(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """More variables or writers than one cell can hold."""
    if len(cell.variables) > MAX_VARIABLES:
        variable = cell.variables[MAX_VARIABLES]
        message = (
            f"the cell has {len(cell.variables)} variables, the limit is {MAX_VARIABLES}; "
            f"`{variable.name}` is one too many"
        )
        hint = "split the variables over two files with two Modbus units"
        yield rule.at(variable.position, message, hint=hint)
    writers = list(cell.document.writers.values())
    if len(writers) > MAX_WRITERS:
        message = f"the cell has {len(writers)} writers, but the limit is {MAX_WRITERS}"
        hint = "let writers with equal rights share one entry with a network or a list of addresses"
        yield rule.at(writers[MAX_WRITERS].key, message, hint=hint)


@plant_rule("GW124")
def duplicate_cell(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two files describe a cell of the same name."""
    first: dict[str, ExpandedCell] = {}
    for cell in cells:
        name = cell.document.cell
        other = first.setdefault(name, cell)
        if name and other is not cell:
            related = (Related(other.document.at("cell"), f"`{name}` first used here"),)
            message = f"the cell name `{name}` is used by {other.document.source.name} too"
            yield rule.at(cell.document.at("cell"), message, hint="rename one of the two", related=related)


@cell_rule("GW221", Severity.WARNING)
def unmapped_variable(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A variable that no fieldbus can see."""
    examples = alternatives([language.place_example for language in languages() if language.place_example])
    for part in cell.document.variables.values():
        if not any(language.places_of(part, cell.document) for language in languages()):
            message = f"`{part.name}` ({definer().named(part)}) has no address on any fieldbus"
            yield rule.at(part.key, message, hint=f"add {examples}, or remove the line")
