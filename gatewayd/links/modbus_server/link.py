"""The Modbus side of one cell: a unit on a listener that other cells may share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.requester import Requester
from gatewayd.links.contract import Level, Link, LinkHealth
from gatewayd.links.modbus_server.connection import PeerConnection
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.peers import Address, may_connect, writer_of
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, counted


class ModbusUnit(Link):
    """Has no work of its own: what comes for it comes through its listener, which `Listeners.serve` gives it."""

    title = "Modbus unit"
    plan: ModbusPlan

    def __init__(self, plan: ModbusPlan, cell: Cell) -> None:
        self.plan = plan
        self.cell = cell
        self.listener: ModbusListener | None = None

    @property
    def reachable(self) -> bool:
        """While its listener listens."""
        return self.listener is not None and self.listener.listening

    def departing(self, plan: LinkPlan | None, after: CellDefinition) -> Mapping[Requester, str]:
        """Connections that end, lose the unit, or are another writer from then on."""
        assert plan is None or isinstance(plan, ModbusPlan)
        return {requester: why for _connection, requester, why in self._departing(plan, after)}

    def release(self, plan: LinkPlan | None, after: CellDefinition, now: float) -> None:
        """These are writers of the cell no more, before any other connection can be one in their place."""
        assert plan is None or isinstance(plan, ModbusPlan)
        for connection, requester, why in list(self._departing(plan, after)):
            connection.forget(self.plan.unit)
            self.cell.writer_disconnected(requester, now, why, at_once=True)

    def _departing(
        self, plan: ModbusPlan | None, after: CellDefinition
    ) -> Iterator[tuple[PeerConnection, Requester, str]]:
        if self.listener is None:
            return
        for connection, requester in self.listener.writers(self.cell):
            assert requester.writer is not None
            name = self.cell.definition.writers[requester.writer].name
            why = self._moved(plan) or _undeclared(connection.address, name, plan, after)
            if why:
                yield connection, requester, why

    def _moved(self, plan: ModbusPlan | None) -> str:
        """Why no connection goes on; empty: they do."""
        if plan is None:
            return "its Modbus unit is no longer served"
        old, new = address(self.plan.host, self.plan.port), address(plan.host, plan.port)
        if old != new:
            return f"modbus moves: listen {old} -> {new}"
        return "" if plan.unit == self.plan.unit else f"modbus moves: unit {self.plan.unit} -> {plan.unit}"

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


def _undeclared(peer: Address | None, name: str, plan: ModbusPlan | None, after: CellDefinition) -> str:
    """Why the peer would be the writer of this name no more; empty: it would."""
    if plan is None or peer is None or not may_connect(peer, plan):
        return f"the new mapping does not let {peer} connect"
    writer = writer_of(peer, plan.writers)
    found = after.writers[writer].name if writer is not None else "no writer"
    return "" if found == name else f"{peer} is {found} in the new mapping"
