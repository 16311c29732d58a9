"""The Modbus side of one cell: a unit on a listener that other cells may share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.core.requester import Requester
from gatewayd.links.contract import Level, Link, LinkHealth
from gatewayd.links.modbus_server.connection import PeerConnection
from gatewayd.links.modbus_server.credentials import PeerCredentials
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.peers import known_as, may_connect
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, counted
from gatewayd.report.wording import names_and_more


class ModbusUnit(Link):
    """Has no work of its own: what comes for it comes through its listener, which `Listeners.serve` gives it."""

    title = "Modbus unit"
    plan: ModbusPlan

    def __init__(self, plan: ModbusPlan, cell: Cell) -> None:
        self.plan = plan
        self.cell = cell
        self.listeners: list[ModbusListener] = []

    @property
    def reachable(self) -> bool:
        """While one of its listeners listens."""
        return any(listener.listening for listener in self.listeners)

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
        for listener in self.listeners:
            for connection, requester in listener.writers(self.cell):
                assert requester.writer is not None
                name = self.cell.definition.writers[requester.writer].name
                why = self._moved(listener, plan) or _undeclared(connection, name, plan, after)
                if not why and connection.credentials is not None:
                    why = self._narrowed(connection.credentials, plan, after)
                if why:
                    yield connection, requester, why

    def _moved(self, listener: ModbusListener, plan: ModbusPlan | None) -> str:
        """Why no connection of a listener goes on; empty: they do."""
        if plan is None:
            return "its Modbus unit is no longer served"
        secured = listener.files is not None
        if (
            listener.address not in plan.endpoints
            or (plan.endpoints[listener.address] is not None) != secured
        ):
            same = plan.tls is not None if secured else plan.plain
            if not same:
                return f"modbus is not served on {listener.name} any more"
            new = (
                address(plan.tls.host, plan.tls.port)
                if secured and plan.tls
                else address(plan.host, plan.port)
            )
            return f"modbus moves: {'tls: ' if secured else ''}listen {listener.name} -> {new}"
        return "" if plan.unit == self.plan.unit else f"modbus moves: unit {self.plan.unit} -> {plan.unit}"

    def _narrowed(self, shown: PeerCredentials, plan: ModbusPlan | None, after: CellDefinition) -> str:
        """Why its role would have less to write: it could not even take back what it owns. Empty: it has not."""
        if plan is None or plan.tls is None or self.plan.tls is None:
            return ""
        before = _names(self.plan.tls.rights_of(shown.role).writable, self.cell.definition)
        lost = before - _names(plan.tls.rights_of(shown.role).writable, after)
        still = {variable.name for variable in after.variables}
        names = sorted(lost & still)
        return f"{shown.text} may not write {names_and_more(names)} in the new mapping" if names else ""

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Be the unit of another plan and cell; the listeners that it has and had see to the connections."""
        assert isinstance(plan, ModbusPlan)
        self.plan, self.cell = plan, cell

    def health(self) -> LinkHealth:
        """How its listener is; connections are those of all its units."""
        where = address(self.plan.host, self.plan.port)
        main = next((its for its in self.listeners if its.address == (self.plan.host, self.plan.port)), None)
        secured = next((its for its in self.listeners if its.files is not None), None)
        connections = sum(listener.connections for listener in self.listeners)
        figures: dict[str, object] = {
            "listen": where,
            "unit": self.plan.unit,
            "connections": main.connections if main is not None else 0,
            "refused": main.refusals if main is not None else {},
            "ignored": sum(listener.ignored(self.plan.unit) for listener in self.listeners),
            "listening": main is not None and main.listening,
            "tls": None,
            "tls_listen": "",
        }
        problems: tuple[str, ...] = ()
        if self.plan.tls is not None:
            figures |= _secured_figures(address(self.plan.tls.host, self.plan.tls.port), secured)
            if secured is not None and secured.listening:
                from gatewayd.links.modbus_server.renewal import problems_of  # noqa: PLC0415 - where a unit has TLS

                problems = problems_of(secured)
        silent = [listener.name for listener in self.listeners if not listener.listening]
        if not self.reachable:
            level, words = Level.BAD, "not listening, see the log"
        elif silent:
            level, words = Level.BAD, f"not listening on {', '.join(silent)}, see the log"
        else:
            level = Level.WARN if problems else Level.GOOD
            words = f"listening, {counted(connections, 'connection')}"
        return LinkHealth(f"Modbus {where}", level, words, problems=problems, figures=figures)


def _secured_figures(where: str, listener: ModbusListener | None) -> dict[str, object]:
    listening = listener is not None and listener.listening
    figures: dict[str, object] = {
        "listening": listening,
        "connections": listener.connections if listener is not None else 0,
        "refused": listener.refusals if listener is not None else {},
        "handshakes": listener.handshakes if listener is not None else 0,
        "expires": listener.trust.facts.expiries if listener is not None and listening else {},
    }
    flat = {f"tls_{name}": value for name, value in figures.items()}
    return {"tls": {"listen": where, **figures}, "tls_listen": where, **flat}


def _undeclared(connection: PeerConnection, name: str, plan: ModbusPlan | None, after: CellDefinition) -> str:
    """Why the peer would be the writer of this name no more; empty: it would."""
    peer = connection.address
    if plan is None or peer is None or not may_connect(peer, plan):
        return f"the new mapping does not let {peer} connect"
    known = known_as(peer, connection.credentials, plan)
    found = after.writers[known[1]].name if known is not None else "no writer"
    return "" if found == name else f"{peer} is {found} in the new mapping"


def _names(indices: tuple[int, ...] | None, definition: CellDefinition) -> set[str]:
    """Names of these variables; None: of all that can be written."""
    variables = (
        definition.variables if indices is None else [definition.variables[index] for index in indices]
    )
    return {variable.name for variable in variables if variable.direction is Direction.INPUT}
