"""All rules together: importing this module fills the catalogue, `check_cell` and `check_plant` apply it."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from gatewayd.links.registry import languages
from gatewayd.mapping.diagnostics import Diagnostic
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules import bounds, failsafe, ownership, sharing, supervision
from gatewayd.mapping.rules.registry import CELL_CHECKS, PLANT_CHECKS

RULE_MODULES = (
    bounds,
    ownership,
    sharing,
    failsafe,
    supervision,
    *(import_module(name) for language in languages() for name in language.rules),
)
"""The modules whose rules are applied: those of the language, and those of each kind of link."""


def check_cell(cell: ExpandedCell) -> tuple[Diagnostic, ...]:
    """All findings of one cell by itself, in no particular order. Never raises."""
    return tuple(finding for rule, check in CELL_CHECKS for finding in check(rule, cell))


def check_plant(cells: Sequence[ExpandedCell]) -> tuple[Diagnostic, ...]:
    """All findings among cells that are to run in one process, in no particular order. Never raises."""
    return tuple(finding for rule, check in PLANT_CHECKS for finding in check(rule, cells))
