"""How rules about the node enter the catalogue."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import wraps
from typing import ParamSpec, TypeAlias

from gatewayd.links.canopen_node.expand import CanopenCell, node_of
from gatewayd.mapping.diagnostics import Diagnostic, Position, Rule, Severity
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule

NodeCheck: TypeAlias = Callable[[Rule, ExpandedCell, CanopenCell], Iterator[Diagnostic]]
P = ParamSpec("P")


def node_rule(rule_id: str, severity: Severity = Severity.ERROR) -> Callable[[NodeCheck], NodeCheck]:
    """As `cell_rule`; the decorated generator is asked for cells with a node only, and gets that too."""

    def enter(check: NodeCheck) -> NodeCheck:
        @wraps(check)
        def checked(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
            node = node_of(cell)
            if node is not None:
                yield from check(rule, cell, node)

        cell_rule(rule_id, severity)(checked)
        return check

    return enter


def first_at_each_place(check: Callable[P, Iterator[Diagnostic]]) -> Callable[P, Iterator[Diagnostic]]:
    """Of several findings at one place in a file only the first."""

    @wraps(check)
    def checked(*args: P.args, **kwargs: P.kwargs) -> Iterator[Diagnostic]:
        reported: set[Position] = set()
        for finding in check(*args, **kwargs):
            if finding.position not in reported:
                reported.add(finding.position)
                yield finding

    return checked
