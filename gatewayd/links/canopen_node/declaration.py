"""What everybody may know of this kind of link."""

from __future__ import annotations

from collections.abc import Iterable

from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node.description import description
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.contract import Description, LinkKind
from gatewayd.mapping.plan import LinkPlan

__all__ = ["KIND"]


class CanopenNode(LinkKind):
    """The kind with the section `canopen`."""

    key = "canopen"
    title = "CANopen node"
    place = (
        "null, or `object` (2010h:01), `type`, and `cob_id` of the PDO that carries it, null for SDO alone"
    )
    has_one_place = True

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """The node and its object dictionary."""
        assert isinstance(plan, CanopenPlan)
        return description(plan, cell)

    def moved(self, old: LinkPlan, new: LinkPlan) -> Iterable[str]:
        """Another bus, or another node on it, is not the one that a master has started."""
        return ("interface", "channel", "node")


KIND = CanopenNode()
