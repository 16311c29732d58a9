"""Rules GW119 and GW124: how much one cell holds, and what tells cells apart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule
from gatewayd.mapping.expand import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule, plant_rule

__all__ = ["MAXIMUM_VARIABLES", "MAXIMUM_WRITERS"]

MAXIMUM_VARIABLES = 1024
"""The status block has a quality bit and an owner word for so many."""
MAXIMUM_WRITERS = 32
"""The status block has a record for so many."""


@cell_rule(
    "GW119",
    "too-many",
    "more variables or writers than one cell can hold",
)
def too_many(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """The first variable and the first writer beyond the limit."""
    if len(cell.variables) > MAXIMUM_VARIABLES:
        variable = cell.variables[MAXIMUM_VARIABLES]
        message = (
            f"the cell has {len(cell.variables)} variables, the limit is {MAXIMUM_VARIABLES}; "
            f"`{variable.name}` is one too many"
        )
        hint = "split the variables over two files with two Modbus units"
        yield rule.at(variable.position, message, hint=hint)
    writers = list(cell.document.writers.values())
    if len(writers) > MAXIMUM_WRITERS:
        message = f"the cell has {len(writers)} writers, the limit is {MAXIMUM_WRITERS}"
        hint = "let writers with equal rights share one entry with a network or a list of addresses"
        yield rule.at(writers[MAXIMUM_WRITERS].key, message, hint=hint)


@plant_rule(
    "GW124",
    "duplicate-cell",
    "two files describe a cell of the same name",
)
def duplicate_cell(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Equal names of cells."""
    first: dict[str, ExpandedCell] = {}
    for cell in cells:
        name = cell.document.cell
        other = first.setdefault(name, cell)
        if name and other is not cell:
            related = (Related(other.document.at("cell"), f"`{name}` first used here"),)
            message = f"the cell name `{name}` is used by {other.document.source.name} too"
            yield rule.at(cell.document.at("cell"), message, hint="rename one of the two", related=related)
