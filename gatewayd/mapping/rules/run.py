"""All rules together: importing this module fills the catalogue, `check_cell` and `check_plant` apply it."""

from __future__ import annotations

from collections.abc import Sequence

from gatewayd.mapping.diagnostics import Diagnostic
from gatewayd.mapping.expand import ExpandedCell
from gatewayd.mapping.rules import (
    bounds,
    can_bus,
    canopen,
    companions,
    conversion,
    failsafe,
    listener,
    ownership,
    pdo_company,
    pdo_members,
    pdos,
    places,
    rtde,
    sharing,
    supervision,
)
from gatewayd.mapping.rules.registry import CELL_CHECKS, PLANT_CHECKS

__all__ = ["FAMILY_MODULES", "check_cell", "check_plant"]

FAMILY_MODULES = (
    bounds,
    places,
    listener,
    rtde,
    companions,
    canopen,
    pdos,
    pdo_members,
    pdo_company,
    can_bus,
    ownership,
    sharing,
    failsafe,
    supervision,
    conversion,
)
"""The modules whose rules are applied."""


def check_cell(cell: ExpandedCell) -> tuple[Diagnostic, ...]:
    """All findings of one cell by itself, in no particular order. Never raises."""
    return tuple(finding for rule, check in CELL_CHECKS for finding in check(rule, cell))


def check_plant(cells: Sequence[ExpandedCell]) -> tuple[Diagnostic, ...]:
    """All findings among cells that are to run in one process, in no particular order. Never raises."""
    return tuple(finding for rule, check in PLANT_CHECKS for finding in check(rule, cells))
