"""Devices without a gateway, of whatever family: which one a line belongs to follows from how it is written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from gatewayd.core.definition import CellDefinition
from gatewayd.links.access import (
    AccessError,
    AccessProblem,
    DeviceAccess,
    PlaceAnswer,
    PlaceRequest,
    Scan,
    ScanOrder,
)
from gatewayd.links.devices.families import access_of_family
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.examination import RunningCell
from gatewayd.mapping.plan import LinkPlan

_ORDER: Final = ("canopen", "modbus")
"""Families as they are asked whether a line is theirs; the last one takes any."""


class AnyDeviceAccess(DeviceAccess):
    """What the families do."""

    def scan(self, order: ScanOrder) -> Scan:
        """See DeviceAccess."""
        access = next(access for access in map(access_of_family, _ORDER) if access.takes(order))
        foreign = sorted(
            name
            for name, value in order.settings.items()
            if value is not None and name not in access.settings
        )
        if foreign:
            option = f"--{foreign[0].replace('_', '-')}"
            raise AccessError(AccessProblem.BAD_PLACE, f"{order.line} is no line that has {option}")
        return access.scan(order)

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
