"""The Modbus side of one cell: a unit on a listener that other cells may share."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Level, Link, LinkHealth
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, counted


class ModbusUnit(Link):
    """Has no work of its own: what comes for it comes through its listener, which `Listeners.serve` gives it."""

    title = "Modbus unit"

    def __init__(self, plan: ModbusPlan, cell: Cell) -> None:
        self.plan = plan
        self.cell = cell
        self.listener: ModbusListener | None = None

    @property
    def reachable(self) -> bool:
        """While its listener listens."""
        return self.listener is not None and self.listener.listening

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Be the unit of another plan and cell; the listeners that it has and had see to the connections."""
        assert isinstance(plan, ModbusPlan)
        self.plan, self.cell = plan, cell

    def health(self) -> LinkHealth:
        """How its listener is; connections are those of all its units."""
        where = address(self.plan.host, self.plan.port)
        listener = self.listener
        connections = listener.connections if listener is not None else 0
        figures = {
            "listen": where,
            "unit": self.plan.unit,
            "connections": connections,
            "refused": listener.refusals if listener is not None else {},
            "ignored": listener.ignored(self.plan.unit) if listener is not None else 0,
            "listening": self.reachable,
        }
        if self.reachable:
            level, words = Level.GOOD, f"listening, {counted(connections, 'connection')}"
        else:
            level, words = Level.BAD, "not listening, see the log"
        return LinkHealth(f"Modbus {where}", level, words, figures=figures)
