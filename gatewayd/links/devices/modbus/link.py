"""The link to one Modbus device."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from typing import Final

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Context, Level, Link, LinkHealth, Prepared, SharedPart
from gatewayd.links.devices.family import FamilyRuntime
from gatewayd.links.devices.modbus.plan import ModbusDevicePlan
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.mapping.plan import LinkPlan, Plan


class ModbusDeviceLink(Link):
    """Joins one device to a cell."""

    title = "device"
    plan: ModbusDevicePlan

    def __init__(self, plan: ModbusDevicePlan, cell: Cell) -> None:
        self.plan = plan
        self.cell = cell

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on with the same device in the successor of the cell."""
        assert isinstance(plan, ModbusDevicePlan)
        self.plan, self.cell = plan, cell

    def health(self) -> LinkHealth:
        """Nobody speaks to it yet."""
        reason = f"device {self.plan.name}: this gateway does not speak to Modbus devices yet"
        return LinkHealth(self.plan.name, Level.BAD, "not spoken to", problems=(reason,))


class ModbusLines(SharedPart):
    """The connections that Modbus devices are reached by."""

    async def run(self) -> None:
        """Work until cancelled."""
        await asyncio.get_running_loop().create_future()

    async def prepare(self, plans: Sequence[Plan]) -> Prepared:
        """Nothing is needed beforehand: what cannot be reached is tried again."""
        return NothingPrepared()

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Have a connection for each line."""


class NothingPrepared:
    """There is nothing to take back."""

    def commit(self) -> None:
        """See Prepared."""

    async def abort(self) -> None:
        """See Prepared."""


class ModbusDeviceRuntime(FamilyRuntime):
    """Makes links to Modbus devices."""

    def share(self) -> ModbusLines:
        """All lines of a daemon."""
        return ModbusLines()

    def make(self, plan: DevicePlan, cell: Cell, context: Context) -> ModbusDeviceLink:
        """A link without a connection."""
        assert isinstance(plan, ModbusDevicePlan)
        return ModbusDeviceLink(plan, cell)


FAMILY: Final = ModbusDeviceRuntime()
"""Makes links of this family."""
