"""What everybody may know of this kind of link.

What has to do with the plan of a node is imported where there is one: most cells have none.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import TYPE_CHECKING

from gatewayd.core.definition import CellDefinition
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.core.status_layout import StatusField
from gatewayd.links.contract import Description, LinkKind, LinkMetric
from gatewayd.mapping.plan import LinkPlan

if TYPE_CHECKING:
    from gatewayd.links.canopen_node.plan import CanopenPlan

BUS_STATES = ("", "absent", "down", "bus-off", "passive", "warning", "active")
"""What the status word `can_bus` means; 0: there is no CANopen."""
NMT_STATES = {0: "initialising", 4: "stopped", 5: "operational", 127: "pre-operational"}
"""What the status word `nmt_state` means."""


def _numbered(names: Iterable[tuple[int, str]]) -> str:
    return ", ".join(f"{number} {name}" for number, name in names)


class CanopenNode(LinkKind):
    """The kind with the section `canopen`."""

    key = "canopen"
    title = "CANopen node"
    traffic = "gatewayd.links.canopen_node.traffic"
    exports = "gatewayd.links.canopen_node.exports"
    doctor = "gatewayd.links.canopen_node.doctor"
    fields = {  # noqa: RUF012 - never changed
        "channel": "interface:channel of the bus",
        "node": "node-ID of the mapping",
        "bus": "`absent`, `down`, `bus-off`, `passive`, `warning` or `active`",
        "reason": "why the bus is not as it should be, in words; empty where all is well",
        "nmt_state": "`initialising`, `stopped`, `pre-operational` or `operational`",
    }
    status_fields = (
        StatusField(27, 1, "can_bus", f"0 no CANopen, {_numbered(enumerate(BUS_STATES[1:], 1))}"),
        StatusField(28, 1, "nmt_state", _numbered(NMT_STATES.items())),
    )
    metrics = (
        LinkMetric(
            "gatewayd_can_bus_state",
            "bus_state",
            f"{_numbered(enumerate(BUS_STATES[1:], 1))}; only with a CAN bus",
        ),
        LinkMetric(
            "gatewayd_can_total",
            "counters",
            "the CANopen node's counters by name; only with a CAN bus",
            label="counter",
        ),
    )
    place = (
        "null, or `object` (2010h:01), `type`, `scale`, `offset`, and `cob_id` of the PDO that carries it, "
        "null for SDO alone"
    )
    has_one_place = True

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """The node and its object dictionary."""
        from gatewayd.links.canopen_node.description import description
        from gatewayd.links.canopen_node.plan import CanopenPlan

        assert isinstance(plan, CanopenPlan)
        return description(plan, cell)

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """The same node goes on where nothing that its peers rely on is different."""
        from gatewayd.links.canopen_node.continuity import goes_on
        from gatewayd.links.canopen_node.plan import CanopenPlan

        assert isinstance(old, CanopenPlan)
        assert isinstance(new, CanopenPlan)
        return goes_on(old, new, before, after) and not _identities(old, new, before, after)

    def disturbs(
        self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition
    ) -> Iterable[Objection]:
        """Masters would not know the node again, or could rely on it less."""
        from gatewayd.links.canopen_node.continuity import weakened
        from gatewayd.links.canopen_node.plan import CanopenPlan

        assert isinstance(old, CanopenPlan)
        assert isinstance(new, CanopenPlan)
        for text in weakened(old, new):
            yield Objection(ObjectionKind.WEAKENING, text)
        changes = _identities(old, new, before, after)
        if changes:
            yield Objection(
                ObjectionKind.IDENTITY,
                f"{old.channel} node {old.node} would have another identity: {', '.join(changes)}; "
                "masters check it, and LSS selects by it",
            )


def _identities(
    old: CanopenPlan, new: CanopenPlan, before: CellDefinition, after: CellDefinition
) -> tuple[str, ...]:
    """What would be another number in 1018h."""
    from gatewayd.links.canopen_node.identity import (
        identity_of,  # imports a whole node, which only a reload may need
    )

    former, successor = asdict(identity_of(old, before)), asdict(identity_of(new, after))
    return tuple(
        f"{name} 0x{former[name]:08X} -> 0x{number:08X}"
        for name, number in successor.items()
        if number != former[name]
    )


KIND = CanopenNode()
"""What everybody may know of this kind of link."""
