"""Rules GW310, GW315 and GW316: inputs of the robot that act only through others."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from gatewayd.core.definition import Direction
from gatewayd.links.robot.rules.controller import unresolved
from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.rtde.companions import COMPANIONS, Companions


@cell_rule("GW310")
def missing_mask(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A speed slider or robot output without the mask that makes it act."""
    for variable, mask, _ in _without(cell, lambda needs: needs.mask):
        if mask not in _mapped(cell):
            message = f"`{variable.name}` ({variable.target}) has no effect without `{mask}`"
            yield rule.at(variable.at("robot"), message, hint=f"map `{mask}` as a variable too")


@cell_rule("GW316", Severity.WARNING)
def missing_mask_bit(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A robot output whose own bit of the mask is not mapped."""
    for variable, mask, bit in _without(cell, lambda needs: needs.mask):
        if mask in _mapped(cell):
            message = f"`{variable.name}` ({variable.target}) has no effect without bit {bit} of `{mask}`"
            yield rule.at(variable.at("robot"), message, hint=f"map `{mask}.{bit}` as a variable too")


@cell_rule("GW315", Severity.WARNING)
def missing_domain(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An analog output without the bit that says whether it is a current or a voltage."""
    for variable, domain, bit in _without(cell, lambda needs: needs.type):
        message = f"`{variable.name}` ({variable.target}) is a current or a voltage, and nothing says which"
        yield rule.at(variable.at("robot"), message, hint=f"map `{domain}.{bit}` as a variable too")


def _without(
    cell: ExpandedCell, companion_of: Callable[[Companions], str | None]
) -> Iterator[tuple[ExpandedVariable, str, int]]:
    """The first input of each line whose companion is not mapped in its bit; with the companion and that bit.

    A whole word of outputs has its companion where any bit of it is mapped: which outputs it sets may be chosen there.
    """
    mapped = _mapped(cell)
    # What is missing may be meant by a line that could not be read; that line has its own finding.
    broken = {error.name for _, error in unresolved(cell)}
    if len(cell.document.declared("variables")) != len(cell.document.variables):
        return
    seen: set[tuple[str, str]] = set()
    for variable in cell.variables:
        needs = COMPANIONS.get(variable.field)
        companion = companion_of(needs) if needs is not None else None
        key = variable.part.name, variable.field
        if needs is None or companion is None or companion in broken or key in seen:
            continue
        wanted = variable.bit if needs.bit is None else needs.bit
        bits = mapped.get(companion, set())
        if None in bits or (bits if wanted is None else wanted in bits):
            continue
        seen.add(key)
        yield variable, companion, wanted or 0


def _mapped(cell: ExpandedCell) -> dict[str, set[int | None]]:
    """Fields of inputs -> the bits of them that are mapped; None for the whole."""
    found: dict[str, set[int | None]] = {}
    for variable in cell.variables:
        if variable.direction is Direction.INPUT:
            found.setdefault(variable.field, set()).add(variable.bit)
    return found
