"""What everybody may know of this kind of link."""

from __future__ import annotations

from collections.abc import Iterable

from gatewayd.core.definition import CellDefinition
from gatewayd.links.contract import Description, LinkKind
from gatewayd.links.robot.description import description
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.mapping.plan import LinkPlan

__all__ = ["KIND"]


class Robot(LinkKind):
    """The kind with the section `robot`."""

    key = "robot"
    title = "Universal Robots controller"

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """The session with the controller."""
        assert isinstance(plan, RobotPlan)
        return description(plan, cell)

    def moved(self, old: LinkPlan, new: LinkPlan) -> Iterable[str]:
        """Another address is another robot."""
        return ("host", "port")


KIND = Robot()
