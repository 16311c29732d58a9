"""What masters know the node of a cell by, without a running one."""

from __future__ import annotations

from gatewayd.canopen.identity import Identity
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.links.canopen_node.node import Node
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.canopen_node.store import Store


def idle_node(plan: CanopenPlan, definition: CellDefinition) -> Node:
    """A node that has its objects and sends nothing."""
    return Node(plan, Cell(definition), lambda _frame, _priority: False, Store(), lambda _now: True)


def identity_of(plan: CanopenPlan, definition: CellDefinition) -> Identity:
    """The numbers of 1018h. The daemon asks at a reload: nothing of the mapping language is imported for it.

    A whole node, 20 ms of the loop for a full image, is made only where the revision follows its dictionary.
    """
    return plan.identity.of(definition, lambda: idle_node(plan, definition).identity.revision)
