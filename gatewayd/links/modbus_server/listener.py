"""The listener: one address, the units served there, and who may reach which of them.

asyncio accepts connections; `PeerConnection` serves one of them, `limits` says which have to end.
"""

from __future__ import annotations

import asyncio
import errno
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING

from gatewayd.core.cell import Cell
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.core.requester import Requester
from gatewayd.links.contract import Tap
from gatewayd.links.modbus_server.connection import PeerConnection
from gatewayd.links.modbus_server.default_unit import NamedPlan, default_cell, default_for, losing, lost
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.handshakes import PATIENCE, Handshakes
from gatewayd.links.modbus_server.limits import idle_timeout, overdue
from gatewayd.links.modbus_server.peers import (
    WITH_TLS,
    PeerEvent,
    PeerEventKind,
    PeerLog,
    known_as,
    may_connect,
)
from gatewayd.links.modbus_server.plan import ModbusPlan, RoleRights, TrustFiles
from gatewayd.links.modbus_server.polling import ReadPoller
from gatewayd.links.modbus_server.rights import Rights
from gatewayd.links.modbus_server.session import UnitAccess
from gatewayd.links.modbus_server.shares import Shares
from gatewayd.links.modbus_server.waiting import SETTLING
from gatewayd.links.modbus_server.writers import Accesses, names_of, succeeded, writers_of
from gatewayd.loop import clock
from gatewayd.report.format import address as address_text

if TYPE_CHECKING:
    # What TLS needs is imported where a listener has it.
    from gatewayd.links.modbus_server.secure_connection import SecurePeerConnection
    from gatewayd.links.modbus_server.trust import Trust

_SWEEP = 0.25
"""Seconds between two looks for connections that are idle or stalled."""

_ACCEPTED_AT_ONCE = 8
"""Connections, in one turn of the loop: those of a flood wait in the kernel, not in the way of requests.
asyncio takes as many at once as it asks the kernel to queue."""
_BACKLOG = 128
"""Connections that the kernel keeps until they are accepted; of further ones the peer tries again after a second."""
_GAPS_WRITTEN = (
    "who writes blocks that cover gaps would be refused with 02, and lose what it owns: write_gaps"
)
_NOBODY: Mapping[Cell, Cell] = MappingProxyType({})
_REMEDIES = {
    errno.EADDRINUSE: "another program listens there; stop it or choose another port under modbus: listen:",
    errno.EACCES: "ports below 1024 need the capability CAP_NET_BIND_SERVICE; grant it or choose a port from 1024 on",
    errno.EADDRNOTAVAIL: "this machine has no such address; use one of its own or 0.0.0.0 under modbus: listen:",
}


class ListenError(OSError):
    """The address cannot be listened on; `errno` says why, the text also what to do."""


class ModbusListener:
    """One listening address and the units behind it.

    `observe` is called with the events of connections; it must not raise.
    """

    def __init__(
        self,
        host: str,
        port: int,
        *,
        files: TrustFiles | None = None,
        observe: Callable[[PeerEvent], None] = lambda _event: None,
    ) -> None:
        """`files`: those of a secured listener (`renew` reads them); None: it has no TLS."""
        self.files = files
        self._trust: Trust | None = None
        self.stamps: tuple[object, ...] = ()
        """Of the files that were looked at last, good or bad."""
        self.problem = ""
        """Why other files than those in use cannot be used."""
        self._handshakes = Handshakes()
        self._limited: dict[tuple[int, RoleRights | None], Unit] = {}
        """Units as roles have them, by number."""
        self._host = host
        self._port = port
        self._observe = observe
        self._units: dict[int, Unit] = {}
        self._connections: dict[PeerConnection, None] = {}
        self._shares = Shares(())
        self._peer_log = PeerLog()
        self.refusals = {
            kind.name.lower(): 0
            for kind in PeerEventKind
            if kind.refused and (files is not None or kind not in WITH_TLS)
        }
        """How many connections never began, by reason."""
        self._tap: Tap | None = None
        self._server: asyncio.Server | None = None
        self._poller: ReadPoller | None = None
        self._sweeper: asyncio.TimerHandle | None = None
        self._gap = (-math.inf, -math.inf)
        """When the process stood still last, if ever."""
        self.progress = 0
        """Moves with each attempt to listen, and several times a second from then on."""

    @property
    def port(self) -> int:
        """The port that is listened on, also if 0 was asked for."""
        return int(self._server.sockets[0].getsockname()[1]) if self._server is not None else self._port

    @property
    def connections(self) -> int:
        """Connections that are open now."""
        return len(self._connections)

    def ignored(self, unit: int) -> int:
        """Registers and bits with nothing mapped that accepted writes to the unit covered."""
        return self._units[unit].ignored if unit in self._units else 0

    @property
    def handshakes(self) -> int:
        """Handshakes that are under way."""
        return len(self._handshakes)

    @property
    def listening(self) -> bool:
        """Whether connections are accepted now."""
        return self._server is not None

    @property
    def address(self) -> tuple[str, int]:
        """Host and port as asked for."""
        return self._host, self._port

    @property
    def name(self) -> str:
        """Host and port, for messages."""
        return address_text(self._host, self._port)

    @property
    def trust(self) -> Trust:
        """By which files clients are let in now, and what they say; of a secured listener that listens."""
        assert self._trust is not None
        return self._trust

    def renew(self, trust: Trust) -> None:
        """Let clients in by these files from now on. Those that are there stay, unless something was withdrawn."""
        from gatewayd.links.modbus_server.trust import ended_by  # noqa: PLC0415 - where a listener has TLS

        self.files, self._trust, self.stamps, self.problem = trust.files, trust, trust.stamps, ""
        for connection in list(self._connections):
            if connection.credentials is None or connection.trust is None:
                continue
            reason = ended_by(connection.trust, trust, connection.credentials)
            connection.trust = trust
            if reason:
                connection.abort(reason)
                self.disconnected(connection, at_once=trust.facts.revokes(connection.credentials))

    async def start(self) -> None:
        """Listen. Raises ListenError; of a secured listener `renew` was called before."""
        poller = ReadPoller()
        if self.files is None:
            accepted: Callable[[], PeerConnection] = partial(PeerConnection, self, poller)
        else:
            from gatewayd.links.modbus_server.secure_connection import SecurePeerConnection  # noqa: PLC0415

            accepted = partial(SecurePeerConnection, self, poller)
        try:
            server = await asyncio.get_running_loop().create_server(
                accepted, self._host, self._port, reuse_address=True, backlog=_ACCEPTED_AT_ONCE
            )
            for listening in server.sockets:
                with listening.dup() as same:
                    same.listen(_BACKLOG)
        except OSError as error:
            poller.close()
            self.progress += 1
            raise self._explained(error) from error
        self._server, self._poller = server, poller
        self._sweep()

    def _explained(self, error: OSError) -> ListenError:
        remedy = _REMEDIES.get(error.errno or 0, "check modbus: listen:")
        cause = os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
        return ListenError(error.errno, f"cannot listen on {self.name}: {cause}; {remedy}")

    async def close(self, reason: str = "gateway stopped") -> None:
        """Stop listening and end all connections at once; the units follow their cells no longer."""
        if self._sweeper is not None:
            self._sweeper.cancel()
            self._sweeper = None
        for connection in list(self._connections):
            connection.abort(reason)
            self.disconnected(connection)
        self._handshakes.close()
        self._report_kept_back(math.inf)
        for unit in self._units.values():
            unit.close()
        self._units = {}
        server, self._server = self._server, None
        poller, self._poller = self._poller, None
        if server is None or poller is None:
            return
        poller.close()
        for listening in server.sockets:
            asyncio.get_running_loop().remove_reader(listening)
        try:
            # Transports close their sockets in the next turn of the loop. Until then what was accepted already becomes
            # a connection, which is refused. With its server closed, asyncio would drop it without closing its socket.
            await asyncio.sleep(0)
        finally:
            server.close()

    def serve(
        self, units: Iterable[tuple[ModbusPlan, Cell]], successors: Mapping[Cell, Cell] = _NOBODY
    ) -> None:
        """Answer for these units, and for no others, from the next request on; connections stay.

        A unit whose plan and cell are the very objects served already goes on untouched. `successors` are cells that
        took over the connections of another one, so that a writer that is there before and after never leaves. Raises
        ValueError for two units of one number.
        """
        wanted: dict[int, tuple[ModbusPlan, Cell]] = {}
        for plan, cell in units:
            if plan.unit in wanted:
                raise ValueError(
                    f"unit {plan.unit} is served twice on {self.name}: give every cell a unit of its own"
                )
            wanted[plan.unit] = (plan, cell)
        former = self._units
        units_now: dict[int, Unit] = {}
        for number, (plan, cell) in wanted.items():
            kept = former.get(number)
            if kept is None or kept.plan is not plan or kept.cell is not cell:
                kept = Unit(plan, cell, kept)
            units_now[number] = kept
        self._units = units_now
        self._limited = {}
        self._shares = Shares(self._plans(), secured=self.files is not None)
        now = clock.now()
        for connection in list(self._connections):
            if not self._admit(connection, now, "unit no longer served", successors):
                connection.abort("not on the access list any more")
        for number, unit in former.items():
            if units_now.get(number) is not unit:
                unit.cell.health.words["modbus_connections"] = 0
                unit.close()
        self._count()

    def writers(self, cell: Cell) -> list[tuple[PeerConnection, Requester]]:
        """The connections that are writers of the cell."""
        return [
            (connection, requester)
            for connection in self._connections
            for its, requester in writers_of(connection.accesses)
            if its is cell
        ]

    def disturbs(self, after: Sequence[NamedPlan]) -> Iterator[tuple[Cell, Objection]]:
        """Cells whose clients would reach them by the unit ids 0 and 255 no more, if these were the units.

        And those where whole blocks were written over gaps (`write_gaps: ignore`), which would be refused.
        """
        strict = {name for name, plan in after if not plan.ignore_gaps}
        for unit in self._units.values():
            if unit.ignored and unit.plan.ignore_gaps and unit.cell.definition.name in strict:
                yield unit.cell, Objection(ObjectionKind.RELEASE, _GAPS_WRITTEN)
        cells = {unit.cell.definition.name: unit.cell for unit in self._units.values()}
        before = [(unit.cell.definition.name, unit.plan) for unit in self._units.values()]
        addresses = [its.address for its in self._connections if its.address is not None]
        moved = {each for each in addresses if default_for(each, before) != default_for(each, after)}
        for name, other in lost(before, after, addresses).items():
            writers = self.writers(cells[name])
            departing = [requester for connection, requester in writers if connection.address in moved]
            yield cells[name], losing(cells[name], other, departing)

    def trace(self, tap: Tap | None) -> None:
        """Hand `tap` the frames of all connections, those to come as well; None: no more."""
        if tap is not self._tap:
            self._tap = tap
            for connection in self._connections:
                connection.trace(tap)

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`: what is in the sockets may have waited that long."""
        self._gap = since, now
        self._handshakes.stood_still(now - since)
        for connection in self._connections:
            connection.stood_still(since, now)

    # -- called by connections ------------------------------------------------------------------------------------

    def arrived(self, connection: SecurePeerConnection) -> None:
        """A peer has connected to a secured listener: have its handshake, or refuse it."""
        now = clock.now()
        if not self._reaches(connection, now):
            return
        former = self._handshakes.begin(connection, now)
        if former is not None:
            former.fail(PeerEventKind.UNFINISHED, "made room for another handshake")

    def ready(self, connection: SecurePeerConnection) -> None:
        """Its handshake can go on."""
        self._handshakes.ready(connection)

    def refused(self, connection: SecurePeerConnection, kind: PeerEventKind, reason: str) -> None:
        """A handshake has failed, or took too long."""
        if self._handshakes.end(connection):
            self.refusals[kind.name.lower()] += 1
            self._report(kind, connection, clock.now(), reason)

    def _reaches(self, connection: PeerConnection, now: float) -> bool:
        """Whether the peer may reach any unit; refused if not."""
        if self._server is None:
            connection.abort("not listening")
            return False
        address = connection.address
        if address is None or not any(may_connect(address, unit.plan) for unit in self._units.values()):
            self._refuse(connection, PeerEventKind.DENIED, now)
            return False
        return True

    def connected(self, connection: PeerConnection) -> None:
        """A peer has connected, and has shown who it is where that is asked for: let it in or refuse it."""
        now = clock.now()
        self._handshakes.end(connection)
        if not self._reaches(connection, now) or not self._still_trusts(connection, now):
            return
        address = connection.address
        assert address is not None
        connection.places = self._shares.places_of(address, connection.credentials)
        room = self._shares.room_for(connection, self._connections, now)
        if isinstance(room, PeerEventKind):
            self._refuse(connection, room, now)
            return
        for former in room:
            former.abort(f"made room for {address}")
            self.disconnected(former)
        self._connections[connection] = None
        connection.trace(self._tap)
        since, until = self._gap
        if connection.established <= until + SETTLING:
            connection.wait(min(since, connection.established), until)
        self._admit(connection, now, "")
        self._count()
        self._report(PeerEventKind.CONNECTED, connection, now)

    def _still_trusts(self, connection: PeerConnection, now: float) -> bool:
        """Whether the files by which its handshake began would let it in now; refused if not."""
        if connection.credentials is None or connection.trust is None:
            return True
        from gatewayd.links.modbus_server.trust import ended_by  # noqa: PLC0415 - where a listener has TLS

        reason = ended_by(connection.trust, self.trust, connection.credentials)
        connection.trust = self.trust
        if reason:
            self._refuse(connection, PeerEventKind.UNVERIFIED, now, reason)
        return not reason

    def disconnected(self, connection: PeerConnection, *, at_once: bool = False) -> None:
        """A connection has ended; called once or more for each. `at_once`: nothing it owns outlives it."""
        if self._handshakes.end(connection):
            self._refuse(connection, PeerEventKind.UNSECURED, clock.now(), connection.reason)
        if connection not in self._connections:
            return
        del self._connections[connection]
        now = clock.now()
        accesses, connection.accesses = connection.accesses, {}
        connection.session.serve({})
        for cell, requester in writers_of(accesses):
            cell.writer_disconnected(requester, now, connection.reason, at_once=at_once)
        self._count()
        self._report(PeerEventKind.DISCONNECTED, connection, now, connection.reason)

    # -- inside ---------------------------------------------------------------------------------------------------

    def _admit(
        self,
        connection: PeerConnection,
        now: float,
        reason: str,
        successors: Mapping[Cell, Cell] = _NOBODY,
    ) -> bool:
        """Give the connection the units its address may reach; returns whether there is any.

        Writers that it is both before and after stay connected throughout.
        """
        address = connection.address
        accesses = self._accesses(connection)
        connection.fill(
            frozenset() if address is None else self._shares.places_of(address, connection.credentials)
        )
        before, after = succeeded(writers_of(connection.accesses), successors), writers_of(accesses)
        left = self._left(connection.accesses, accesses, successors)
        connection.accesses = accesses
        connection.session.serve(accesses)
        for cell, requester in after:
            if (cell, requester) not in before:
                cell.writer_connected(requester, now, connection.peer)
        for cell, requester in before:
            if (cell, requester) not in after:
                cell.writer_disconnected(requester, now, reason)
            elif cell is left:
                # Whether it asked by these ids or by the cell's own is not known: it may write anew by its own.
                why = "the unit ids 0 and 255 are another cell's or nobody's"
                cell.writer_disconnected(requester, now, why, at_once=True)
                cell.writer_connected(requester, now, connection.peer)
        return bool(accesses)

    @staticmethod
    def _left(before: Accesses, after: Accesses, successors: Mapping[Cell, Cell]) -> Cell | None:
        """The cell that a connection had at 0 and 255 and has there no more."""
        former = default_cell(before)
        cell = None if former is None else successors.get(former, former)
        return None if cell is default_cell(after) else cell

    def _accesses(self, connection: PeerConnection) -> dict[int, UnitAccess]:
        """What a peer may do, by unit."""
        address, shown = connection.address, connection.credentials
        if address is None:
            return {}
        peer = str(address) if shown is None else f"{address} ({shown.text})"
        found = {}
        for number, unit in self._units.items():
            if may_connect(address, unit.plan):
                known = known_as(address, shown, unit.plan)
                requester = Requester(None if known is None else known[1], peer, connection.number)
                found[number] = UnitAccess(
                    unit if shown is None else self._limited_to(number, unit, shown.role), requester
                )
        return found

    def _limited_to(self, number: int, unit: Unit, role: str | None) -> Unit:
        """The unit as a role has it."""
        assert unit.plan.tls is not None
        granted = unit.plan.tls.rights_of(role)
        key = number, granted if granted in unit.plan.tls.roles else None
        if key not in self._limited:
            rights = Rights(unit.plan, granted)
            self._limited[key] = unit.limited(rights) if rights.limited else unit
        return self._limited[key]

    def _refuse(self, connection: PeerConnection, kind: PeerEventKind, now: float, reason: str = "") -> None:
        connection.abort(reason or kind.value)
        self.refusals[kind.name.lower()] += 1
        self._report(kind, connection, now, reason or kind.value)

    def _report(self, kind: PeerEventKind, connection: PeerConnection, now: float, reason: str = "") -> None:
        address = connection.address
        if self._peer_log.reports(str(address), kind, now):
            writers = names_of(self._accesses(connection)) if self._is_known(connection) else ()
            self._observe(
                PeerEvent(kind, connection.peer, writers, reason, credentials=connection.credentials)
            )

    def _is_known(self, connection: PeerConnection) -> bool:
        """Whether it is known which writer the peer is: with TLS not before the handshake."""
        return self.files is None or connection.credentials is not None

    def _report_kept_back(self, now: float) -> None:
        for event in self._peer_log.kept_back(now):
            self._observe(event)

    def _plans(self) -> list[ModbusPlan]:
        return [unit.plan for unit in self._units.values()]

    def _sweep(self) -> None:
        self.progress += 1
        now = clock.now()
        self._report_kept_back(now)
        for handshake in self._handshakes.overdue(now):
            handshake.fail(PeerEventKind.UNFINISHED, f"not finished within {PATIENCE:g} s")
        idle = idle_timeout(self._plans())
        for connection in list(self._connections):
            reason = overdue(connection, idle, now)
            if reason:
                connection.abort(reason)
        delay = _SWEEP if idle is None else min(_SWEEP, idle / 4)
        self._sweeper = asyncio.get_running_loop().call_later(delay, self._sweep)

    def _count(self) -> None:
        for unit in self._units.values():
            unit.cell.health.words["modbus_connections"] = len(self._connections)
