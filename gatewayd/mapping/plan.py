"""The compiled mapping: everything the links need, worked out once, immutable.

`gatewayd.mapping.compile` makes it; `gatewayd.service.daemon` hands its parts to the core and to the links. It travels
between processes (pickle), and equals what it was there.
"""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.robot.plan import RobotPlan

__all__ = ["Plan"]


@dataclass(frozen=True, slots=True)
class Plan:
    """One robot cell, compiled."""

    source: str
    """Path of the mapping file as given."""
    cell: CellDefinition
    robot: RobotPlan
    modbus: ModbusPlan | None
    canopen: CanopenPlan | None = None
