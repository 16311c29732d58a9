"""How a rule enters the catalogue: one function is its name, its summary and its check.

The function's name is that of the rule, with dashes; its docstring is what the rule finds, as `check --explain all`
lists it. Both are public.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final, TypeAlias, TypeVar

from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity, declare
from gatewayd.mapping.expanded import ExpandedCell

CellCheck: TypeAlias = Callable[[Rule, ExpandedCell], Iterator[Diagnostic]]
"""Looks at one cell. Must not raise, whatever the cell holds: a finding is its only way to complain."""
PlantCheck: TypeAlias = Callable[[Rule, Sequence[ExpandedCell]], Iterator[Diagnostic]]
"""Looks at all cells that are checked together. Must not raise."""
_Check = TypeVar("_Check", CellCheck, PlantCheck)

CELL_CHECKS: Final[list[tuple[Rule, CellCheck]]] = []
PLANT_CHECKS: Final[list[tuple[Rule, PlantCheck]]] = []


def cell_rule(rule_id: str, severity: Severity = Severity.ERROR) -> Callable[[CellCheck], CellCheck]:
    """Declare a rule; the decorated generator finds its breaches in one cell."""
    return _entering(CELL_CHECKS, rule_id, severity)


def plant_rule(rule_id: str, severity: Severity = Severity.ERROR) -> Callable[[PlantCheck], PlantCheck]:
    """Declare a rule; the decorated generator finds its breaches among several cells."""
    return _entering(PLANT_CHECKS, rule_id, severity)


def _entering(
    checks: list[tuple[Rule, _Check]], rule_id: str, severity: Severity
) -> Callable[[_Check], _Check]:
    def enter(check: _Check) -> _Check:
        slug, found = check.__name__.replace("_", "-"), (check.__doc__ or "").rstrip(".")
        home = check.__module__.rpartition(".")[0]
        rule = declare(rule_id, slug, found[:1].lower() + found[1:], severity, home=home)
        checks.append((rule, check))
        return check

    return enter
