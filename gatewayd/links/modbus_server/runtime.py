"""What the daemon needs of this kind of link."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Context, LinkRuntime
from gatewayd.links.modbus_server.link import ModbusUnit
from gatewayd.links.modbus_server.listeners import Listeners
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.plan import LinkPlan


class ModbusRuntime(LinkRuntime):
    """Units, and the listeners that they share."""

    def share(self) -> Listeners:
        """All listeners of a daemon."""
        return Listeners()

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> ModbusUnit:
        """A unit; `Listeners.serve` makes it reachable."""
        assert isinstance(plan, ModbusPlan)
        return ModbusUnit(plan, cell)


RUNTIME = ModbusRuntime()
"""What the daemon needs of this kind of link."""
