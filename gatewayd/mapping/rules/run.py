"""All rules together: importing this module fills the catalogue, `check_cell` and `check_plant` apply it."""

from __future__ import annotations

from collections.abc import Sequence

from gatewayd.links.canopen_node.rules import bus, node, pdo_company, pdo_members, pdos
from gatewayd.links.modbus_server.rules import listener, places
from gatewayd.links.robot.rules import companions
from gatewayd.links.robot.rules import fields as robot_fields
from gatewayd.mapping.diagnostics import Diagnostic
from gatewayd.mapping.expand import ExpandedCell
from gatewayd.mapping.rules import bounds, conversion, failsafe, ownership, sharing, supervision
from gatewayd.mapping.rules.registry import CELL_CHECKS, PLANT_CHECKS

__all__ = ["FAMILY_MODULES", "check_cell", "check_plant"]

FAMILY_MODULES = (
    bounds,
    places,
    listener,
    robot_fields,
    companions,
    node,
    pdos,
    pdo_members,
    pdo_company,
    bus,
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
