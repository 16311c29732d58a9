"""Devices without a gateway, of whatever family: which one a line belongs to follows from how it is written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from gatewayd.core.definition import CellDefinition
from gatewayd.links.access import DeviceAccess, PlaceAnswer, PlaceRequest, Scan, ScanOrder
from gatewayd.links.devices.families import access_of_family
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.examination import RunningCell
from gatewayd.mapping.plan import LinkPlan


class AnyDeviceAccess(DeviceAccess):
    """What the families do."""

    def scan(self, order: ScanOrder) -> Scan:
        """See DeviceAccess."""
        return access_of_family("modbus").scan(order)

    def refusal(self, plan: LinkPlan, running: Sequence[RunningCell]) -> str:
        """See DeviceAccess."""
        assert isinstance(plan, DevicePlan)
        return access_of_family(plan.family).refusal(plan, running)

    async def ask(self, plan: LinkPlan, cell: CellDefinition, request: PlaceRequest) -> PlaceAnswer:
        """See DeviceAccess."""
        assert isinstance(plan, DevicePlan)
        return await access_of_family(plan.family).ask(plan, cell, request)


ACCESS: Final = AnyDeviceAccess()
"""Talks to devices where no gateway does."""
