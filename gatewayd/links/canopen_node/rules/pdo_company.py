"""Rules GW433 and GW434: variables that share the fate of a PDO."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.definition import Direction, FallbackKind
from gatewayd.links.canopen_node.expand import CanopenCell, ExpandedPdo
from gatewayd.links.canopen_node.rules.registry import first_at_each_place, node_rule
from gatewayd.links.canopen_node.sections import CanopenWriter
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLock, ExpandedVariable

__all__: list[str] = []


@node_rule("GW433", Severity.WARNING)
@first_at_each_place
def silenced_neighbour(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A variable whose PDO stops because of another variable in it."""
    for pdo in _pdos(node, Direction.OUTPUT):
        variables = [cell.variables[entry.variable] for entry in pdo.entries]
        silent = [variable for variable in variables if variable.spec.on_stale.kind is FallbackKind.EXCEPTION]
        others = [
            variable for variable in variables if variable.spec.on_stale.kind is not FallbackKind.EXCEPTION
        ]
        if not silent or not (others or pdo.status):
            continue
        other = others[0].name if others else pdo.status[0].name
        message = f"{pdo.label} stops when `{silent[0].name}` is stale, and `{other}` is in it too"
        hint = f"put `{silent[0].part.name}` into a PDO of its own"
        if others:
            related = (Related(others[0].position, f"`{other}` has another policy"),)
            hint += ", or write `on_stale: exception` at both"
        else:
            related = (Related(pdo.position, f"`{other}` is in this PDO"),)
        yield rule.at(silent[0].at("on_stale"), message, hint=hint, related=related)


@node_rule("GW434", Severity.WARNING)
@first_at_each_place
def contended_pdo(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """Variables in one PDO that may be held by different owners."""
    for pdo in _pdos(node, Direction.INPUT):
        locked = list(_locked(cell, pdo))
        if len({lock.members for _, lock in locked}) < 2:
            continue
        shared = next((variable for variable, lock in locked if _is_contended(cell, lock)), None)
        if shared is None:
            continue
        other = next(variable for variable, _ in locked if variable.lock != shared.lock)
        message = f"{pdo.label} carries `{shared.name}`, which another owner may hold, and `{other.name}`"
        related = (Related(other.position, f"`{other.name}` is refused with it"),)
        hint = "write `group: NAME` at both, make a PDO for each, or give both one owner"
        yield rule.at(shared.position, message, hint=hint, related=related)


def _locked(cell: ExpandedCell, pdo: ExpandedPdo) -> Iterator[tuple[ExpandedVariable, ExpandedLock]]:
    for entry in pdo.entries:
        variable = cell.variables[entry.variable]
        if variable.lock is not None:
            yield variable, cell.locks[variable.lock]


def _is_contended(cell: ExpandedCell, lock: ExpandedLock) -> bool:
    """Whether a writer that does not write by RPDO may own it."""
    return any(not cell.document.writers[name].spec.by(CanopenWriter).by_rpdo for name in lock.owners)


def _pdos(node: CanopenCell, direction: Direction) -> Iterator[ExpandedPdo]:
    for pdo in node.pdos:
        if pdo.direction is direction and all(entry.direction is direction for entry in pdo.entries):
            yield pdo
