"""The object dictionary of a node, put together from what its services and its cell bring."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Protocol

from gatewayd.canopen.dictionary import Object
from gatewayd.canopen.identity import Identity, identity_objects
from gatewayd.canopen.sdo.server import server_parameter
from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.links.canopen_node.peers import Peers
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.canopen_node.status_objects import StatusObjects
from gatewayd.links.canopen_node.variables import VariableObjects
from gatewayd.links.registry import status_fields


class ObjectSource(Protocol):
    """What brings objects."""

    def objects(self) -> Iterable[Object]:
        """Its objects."""


def service_objects(node: int, services: Iterable[ObjectSource]) -> Iterable[Object]:
    """Of CiA 301: the SDO server's, with `node` in its COB-IDs, and those of services."""
    yield server_parameter(node)
    for service in services:
        yield from service.objects()


def cell_objects(plan: CanopenPlan, cell: Cell, peers: Peers, clock: Callable[[], float]) -> Iterable[Object]:
    """Of the manufacturer: variables and status block. Who asks by SDO is the plan's writer for it."""

    def asking() -> Requester:
        return peers.asking(plan.sdo_writer, clock())

    yield from VariableObjects(plan, cell, clock, asking).objects()
    requester = partial(peers.requester, plan.sdo_writer)
    yield from StatusObjects(cell, clock, requester, asking).objects()


def identification_objects(identity: Identity, cell: Cell, clock: Callable[[], float]) -> Iterable[Object]:
    """Those that say which node it is; its manufacturer status register (1002h) has the flags of the status block."""
    status = StatusBlock(cell, status_fields())
    return identity_objects(
        identity,
        f"gatewayd {cell.definition.name}",
        lambda: int.from_bytes(status.read(1, 1, clock()), "big"),
    )
