"""How a rule enters the catalogue together with its check."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Final, TypeAlias

from gatewayd.mapping.diagnostics import Diagnostic, Rule, Severity, declare
from gatewayd.mapping.expanded import ExpandedCell

__all__ = ["CELL_CHECKS", "PLANT_CHECKS", "CellCheck", "PlantCheck", "cell_rule", "plant_rule"]

CellCheck: TypeAlias = Callable[[Rule, ExpandedCell], Iterator[Diagnostic]]
"""Looks at one cell. Must not raise, whatever the cell holds: a finding is its only way to complain."""
PlantCheck: TypeAlias = Callable[[Rule, Sequence[ExpandedCell]], Iterator[Diagnostic]]
"""Looks at all cells that are checked together. Must not raise."""

CELL_CHECKS: Final[list[tuple[Rule, CellCheck]]] = []
PLANT_CHECKS: Final[list[tuple[Rule, PlantCheck]]] = []


def cell_rule(
    rule_id: str, slug: str, summary: str, severity: Severity = Severity.ERROR
) -> Callable[[CellCheck], CellCheck]:
    """Declare a rule; the decorated generator finds its breaches in one cell."""

    def enter(check: CellCheck) -> CellCheck:
        CELL_CHECKS.append((declare(rule_id, slug, summary, severity, home=_package(check)), check))
        return check

    return enter


def plant_rule(
    rule_id: str, slug: str, summary: str, severity: Severity = Severity.ERROR
) -> Callable[[PlantCheck], PlantCheck]:
    """Declare a rule; the decorated generator finds its breaches among several cells."""

    def enter(check: PlantCheck) -> PlantCheck:
        PLANT_CHECKS.append((declare(rule_id, slug, summary, severity, home=_package(check)), check))
        return check

    return enter


def _package(check: Callable[..., object]) -> str:
    return check.__module__.rpartition(".")[0]
