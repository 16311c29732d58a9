"""Rules GW410 to GW412 and GW430: what PDOs name, and what names them."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.links.canopen_node.expand import CanopenCell, MemberProblem, Misnamed
from gatewayd.links.canopen_node.rules.registry import node_rule
from gatewayd.links.canopen_node.sections import AUTO, NO_PDO, CanopenPlaces, PdoSpec
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.report.wording import did_you_mean

__all__: list[str] = []


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
            message += "is a single variable" if single else f"has {count} members"
            hint = f"write `{name}`" if single else f"write `{name}[0..{count - 1}]` or less"
        else:
            message = f"the PDO `{wrong.pdo}` names `{wrong.text}`, which is no variable of this file"
            hint = did_you_mean(name, declared, "add the variable, or remove the name")
        assert wrong.position is not None
        yield rule.at(wrong.position, message, hint=hint)


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
