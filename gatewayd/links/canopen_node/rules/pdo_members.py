"""Rules GW410 to GW412, GW430, GW433 and GW434: what PDOs name, what names them, and what shares the fate of one."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.core.definition import Direction, FallbackKind
from gatewayd.links.canopen_node.expand import CanopenCell, ExpandedPdo, MemberProblem, Misnamed
from gatewayd.links.canopen_node.rules.registry import first_at_each_place, node_rule
from gatewayd.links.canopen_node.sections import AUTO, NO_PDO, CanopenPlaces, CanopenWriter, PdoSpec
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLock, ExpandedVariable
from gatewayd.report.format import counted
from gatewayd.report.wording import did_you_mean


@node_rule("GW410")
def unknown_pdo(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A PDO that is not declared."""
    known = node.part.spec.pdos
    for part in cell.document.variables.values():
        place = part.spec.by(CanopenPlaces).canopen
        if place is not None and place.pdo not in known and place.pdo not in (AUTO, NO_PDO):
            hint = did_you_mean(
                place.pdo, known, f"add `{place.pdo}` to `pdos` of the section `canopen`, or write auto"
            )
            message = f"the PDO `{place.pdo}` of `{part.name}` is not declared"
            yield rule.at(part.at("canopen", "pdo"), message, hint=hint)


@node_rule("GW411")
def variable_in_two_pdos(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A variable in two PDOs, or twice in one."""
    for wrong in _once(node, MemberProblem.TAKEN, MemberProblem.OBJECT_ONLY):
        assert wrong.variable is not None
        variable = cell.variables[wrong.variable]
        place = wrong.position or variable.part.at("canopen", "pdo")
        if wrong.problem is MemberProblem.OBJECT_ONLY:
            message = f"the PDO `{wrong.pdo}` names `{variable.name}`, whose line says `canopen: object`"
            related = (Related(variable.part.at("canopen"), "the line is here"),)
            hint = "write `canopen: auto` there, or remove it here"
            yield rule.at(place, message, hint=hint, related=related)
            continue
        message = f"`{variable.name}` is in the PDO `{wrong.other}` already"
        yield rule.at(place, message, hint=f"remove it from `{wrong.pdo}` or from `{wrong.other}`")


@node_rule("GW412")
def empty_pdo(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A PDO that carries nothing."""
    if len(cell.document.declared("variables")) > len(cell.document.variables):
        return
    broken = {wrong.pdo for wrong in node.misnamed}
    unresolved = {missing.part.name for missing in cell.unresolved}
    for name in node.empty:
        if name in broken or unresolved & set(_named(node.part.spec.pdos[name])):
            continue
        message = f"no variable is in the PDO `{name}`"
        hint = "name its `variables`, or remove it"
        yield rule.at(node.part.key_at("pdos", name), message, hint=hint)


@node_rule("GW430")
def unknown_pdo_variable(rule: Rule, cell: ExpandedCell, node: CanopenCell) -> Iterator[Diagnostic]:
    """A PDO that names a variable that does not exist."""
    declared = cell.document.declared("variables")
    unresolved = {missing.part.name for missing in cell.unresolved}
    for wrong in _once(node, MemberProblem.UNKNOWN):
        name = wrong.text.partition("[")[0]
        if name in unresolved or (name in declared and name not in cell.document.variables):
            continue
        family = [variable for variable in cell.variables if variable.part.name == name]
        if family:
            count = len(family)
            message = f"the PDO `{wrong.pdo}` names `{wrong.text}`, and `{name}` "
            single = count == 1 and family[0].member is None
            message += "is a single variable" if single else f"has {counted(count, 'member')}"
            hint = f"write `{name}`" if single else f"write `{name}[0..{count - 1}]` or less"
        else:
            message = f"the PDO `{wrong.pdo}` names `{wrong.text}`, which is not a variable of this file"
            hint = did_you_mean(name, declared, "add the variable, or remove the name")
        assert wrong.position is not None
        yield rule.at(wrong.position, message, hint=hint)


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


def _named(pdo: PdoSpec) -> Iterator[str]:
    """The lines that a PDO names."""
    yield from (member.name for member in pdo.variables)
    yield from (member.variables.name for member in pdo.status if member.variables is not None)


def _once(node: CanopenCell, *problems: MemberProblem) -> Iterator[Misnamed]:
    """The first of each name in each PDO."""
    seen: set[tuple[str, str]] = set()
    for wrong in node.misnamed:
        if wrong.problem in problems and (wrong.pdo, wrong.text) not in seen:
            seen.add((wrong.pdo, wrong.text))
            yield wrong


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
