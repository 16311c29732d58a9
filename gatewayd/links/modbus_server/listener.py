"""The listener: pymodbus's TCP server with its connection handler replaced by ours.

pymodbus brings listening, connection objects and their life cycle; what a connection receives goes to `Session` as
it comes. All that is known of pymodbus is in this module.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import math
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, cast

from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester, new_connection
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.peers import (
    Address,
    DenialLog,
    PeerEvent,
    PeerEventKind,
    address_of,
    may_connect,
    writer_of,
)
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.polling import ReadPoller
from gatewayd.links.modbus_server.session import Access, Session
from gatewayd.links.modbus_server.sockets import has_unread, seconds_since_established, set_options
from gatewayd.links.modbus_server.waiting import SETTLING, Waiting
from gatewayd.links.modbus_server.writers import hold_anything, names_of, succeeded, writers_of
from gatewayd.logs.records import fields
from gatewayd.loop import clock

# pymodbus.server imports aiohttp for a web page of its own, if it is there, and does without if not. It is there, for
# the control interface, but imported at this point it would be most of the time until the gateway serves.
_hidden = "aiohttp" not in sys.modules
if _hidden:
    sys.modules["aiohttp"] = None  # type: ignore[assignment]
try:
    from pymodbus.server import ModbusTcpServer
    from pymodbus.server.requesthandler import ServerRequestHandler
    from pymodbus.simulator import SimData, SimDevice
finally:
    if _hidden:
        del sys.modules["aiohttp"]

__all__ = ["ListenError", "ModbusListener"]

UNUSED_AFTER = 10.0
"""Seconds without a request after which a connection without locks may have to make room for a new one."""
STALLED_AFTER = 5.0
"""Seconds for which a peer may leave its answers unread."""
_SWEEP = 0.25
"""Seconds between two looks for connections that are idle or stalled."""

_REMEDIES = {
    errno.EADDRINUSE: "another program listens there; stop it or choose another port under modbus: listen:",
    errno.EACCES: "ports below 1024 need the capability CAP_NET_BIND_SERVICE; grant it or choose a port from 1024 on",
    errno.EADDRNOTAVAIL: "this machine has no such address; use one of its own or 0.0.0.0 under modbus: listen:",
}

_log = logging.getLogger("gatewayd.modbus")
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)


class ListenError(OSError):
    """The address cannot be listened on; `errno` tells why, the text also what to do."""


class _Connection(ServerRequestHandler):
    """One connection, from its acceptance on."""

    def __init__(self, server: _Server) -> None:
        super().__init__(server, None, None, None)  # type: ignore[no-untyped-call]
        self.owner = server.owner
        self.poller = server.poller
        self.session = Session()
        self.receive = self.session.received
        """What takes the bytes that came in; another function while they may have waited."""
        self.waiting: Waiting | None = None
        self.number = new_connection()
        self.peer = ""
        self.address: Address | None = None
        self.accesses: dict[int, Access] = {}
        self.last_request = 0.0
        """When the last whole request came in; bytes that make none keep no connection open."""
        self.stalled_since: float | None = None
        self.established = 0.0
        """When the kernel had the connection; it may have waited for its acceptance."""
        self.reason = "closed by the peer"
        self.descriptor = -1

    @property
    def wire(self) -> asyncio.Transport:
        """The transport under its right type."""
        return cast("asyncio.Transport", self.transport)

    def callback_connected(self) -> None:
        """Called once, after the connection was accepted."""
        # Answers that the peer does not take stop its requests at once, so at most one turn's answers ever wait.
        self.wire.set_write_buffer_limits(high=0)
        self.wire.pause_reading()
        peer = self.wire.get_extra_info("peername")
        if not peer:
            self.wire.abort()
            return
        self.peer = f"[{peer[0]}]:{peer[1]}" if ":" in peer[0] else f"{peer[0]}:{peer[1]}"
        self.address = address_of(peer[0])
        sock = self.wire.get_extra_info("socket")
        self.descriptor = sock.fileno()
        set_options(sock)
        now = clock.now()
        self.last_request, self.established = now, now - seconds_since_established(sock)
        if self.owner.connected(self):
            self.poller.add(self.descriptor, self.readable)
            asyncio.get_running_loop().call_soon(self._pause_again)

    def _pause_again(self) -> None:
        """Keep the transport from reading: the asyncio of Python 3.11.2 (Debian 12) forgets what `pause_reading` said
        before the connection was complete, and pymodbus would answer what it reads, from its own data store.
        """
        if not self.wire.is_closing():
            self.wire.resume_reading()
            self.wire.pause_reading()

    def readable(self) -> None:
        """The socket has something to read: the hot path."""
        session = self.session
        try:
            count = os.readv(self.descriptor, session.buffer.space)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self.abort(str(error))
            return
        if not count:
            self.drop("closed by the peer")
            return
        # Only now: until the bytes were read they may have waited, and others of this turn were served before.
        now = clock.judged_now()
        try:
            answers = self.receive(count, now)
        except Exception:  # noqa: BLE001 - a defect of ours costs this connection, not the others
            received = bytes(session.buffer.data[: session.buffer.end + count]).hex(" ")
            _log.exception("a request could not be answered", extra=fields(peer=self.peer, received=received))
            self.abort("internal error")
            return
        if answers:
            self.last_request = now
            try:
                sent = os.write(self.descriptor, answers)
            except (BlockingIOError, InterruptedError):
                sent = 0
            except OSError as error:
                self.abort(str(error))
                return
            if sent < len(answers):
                self.wire.write(answers[sent:])
        if session.broken:
            self.drop(f"no Modbus TCP: {session.broken}")

    def stood_still(self, since: float, until: float) -> None:
        """Nothing was read for this time: it is no silence of the peer, and what is in the socket may be that old."""
        length = until - since
        self.last_request += length
        if self.stalled_since is not None:
            self.stalled_since += length
        self.wait(since, until)

    def wait(self, since: float, until: float) -> None:
        """What is in the socket may have waited from `since` to `until`."""
        unread = bool(self.session.buffer.end) or has_unread(self.descriptor)
        self.waiting = Waiting(since, until, unread=unread, former=self.waiting)
        self.receive = self._receive_late

    def _receive_late(self, count: int, now: float) -> bytes:
        """In place of `session.received`, until all that waited was read."""
        session, waiting = self.session, self.waiting
        waited = waiting.seconds(now) if waiting is not None else 0.0
        if waiting is None or not waited:
            self.waiting, self.receive = None, session.received
            return session.received(count, now)
        asked = len(session.buffer.space[0])
        answers = session.received_late(count, now, waited)
        if count < asked and not session.buffer.end:
            waiting.drained()
        return answers

    def pause_writing(self) -> None:
        """The peer does not read its answers: take no more requests."""
        self.stalled_since = clock.now()
        self.poller.remove(self.descriptor)

    def resume_writing(self) -> None:
        """The peer has caught up."""
        self.stalled_since = None
        if not self.wire.is_closing():
            self.poller.add(self.descriptor, self.readable)

    def drop(self, reason: str) -> None:
        """Close the connection after what was answered already."""
        self.reason = reason
        self.poller.remove(self.descriptor)
        if self.transport is not None:
            self.wire.close()

    def abort(self, reason: str) -> None:
        """Close the connection at once."""
        self.reason = reason
        self.poller.remove(self.descriptor)
        if self.transport is not None:
            self.wire.abort()

    def callback_disconnected(self, exc: Exception | None) -> None:
        """Called after the connection has ended, whoever ended it."""
        if exc is not None:
            self.reason = str(exc)
        self.poller.remove(self.descriptor)
        self.owner.disconnected(self)


class _Server(ModbusTcpServer):
    """pymodbus's server with our connections. Its own data store is never asked."""

    def __init__(self, owner: ModbusListener, host: str, port: int) -> None:
        super().__init__(SimDevice(1, [SimData(0)]), address=(host, port))
        self.owner = owner
        self.poller = ReadPoller()

    def callback_new_connection(self) -> _Connection:
        """Called for every accepted connection."""
        return _Connection(self)

    async def listen(self) -> bool:
        """Start listening; unlike pymodbus's own, let the reason out if that fails."""
        self.is_listener = True
        try:
            self.transport = await self.call_create()
        except OSError:
            self.poller.close()
            raise
        return True

    def stop(self) -> None:
        """Stop listening; connections must be aborted by now."""
        self.close()
        self.poller.close()


class ModbusListener:
    """One listening address and the units behind it.

    `observe` is told of connections; it must not raise. Of the units' plans the most generous number of connections
    and idle time-out count, since a connection is not bound to a unit.
    """

    def __init__(
        self,
        host: str,
        port: int,
        *,
        observe: Callable[[PeerEvent], None] = lambda _event: None,
    ) -> None:
        self._host = host
        self._port = port
        self._observe = observe
        self._units: dict[int, Unit] = {}
        self._connections: dict[_Connection, None] = {}
        self._denials = DenialLog()
        self._server: _Server | None = None
        self._sweeper: asyncio.TimerHandle | None = None
        self._gap = (-math.inf, -math.inf)
        """When the process stood still last, if ever."""
        self.turns = 0
        """Moves with each attempt to listen, and several times a second from then on."""

    @property
    def port(self) -> int:
        """The port that is listened on, also if 0 was asked for."""
        sockets = self._sockets()
        return int(sockets[0].getsockname()[1]) if sockets else self._port

    @property
    def connections(self) -> int:
        """Connections that are open now."""
        return len(self._connections)

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
        return f"[{self._host}]:{self._port}" if ":" in self._host else f"{self._host}:{self._port}"

    async def start(self) -> None:
        """Listen. Raises ListenError."""
        server = _Server(self, self._host, self._port)
        try:
            await server.listen()
        except OSError as error:
            self.turns += 1
            remedy = _REMEDIES.get(error.errno or 0, "check modbus: listen:")
            cause = os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
            message = f"cannot listen on {self.name}: {cause}; {remedy}"
            raise ListenError(error.errno, message) from error
        self._server = server
        self._sweep()

    async def close(self, reason: str = "gateway stopped") -> None:
        """Stop listening and end all connections at once; the units follow their cells no longer."""
        if self._sweeper is not None:
            self._sweeper.cancel()
            self._sweeper = None
        for connection in list(self._connections):
            connection.abort(reason)
        server, self._server = self._server, None
        if server is not None:
            server.stop()
        for connection in list(self._connections):
            self.disconnected(connection)
        for unit in self._units.values():
            unit.close()
        self._units = {}
        # The transports close their sockets in the next turn of the loop.
        await asyncio.sleep(0)

    def serve(
        self, units: Iterable[tuple[ModbusPlan, Cell]], successors: Mapping[Cell, Cell] = MappingProxyType({})
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
                kept = Unit(plan, cell)
            units_now[number] = kept
        self._units = units_now
        now = clock.now()
        for connection in list(self._connections):
            if not self._admit(connection, now, "unit no longer served", successors):
                connection.abort("not on the access list any more")
        for number, unit in former.items():
            if units_now.get(number) is not unit:
                unit.cell.health.modbus_connections = 0
                unit.close()
        self._count()

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`: what is in the sockets may have waited that long."""
        self._gap = since, now
        for connection in self._connections:
            connection.stood_still(since, now)

    # -- called by connections ------------------------------------------------------------------------------------

    def connected(self, connection: _Connection) -> bool:
        """A peer has connected: returns whether it is to be served; if not, it was refused."""
        now = clock.now()
        address = connection.address
        if address is None or not any(may_connect(address, unit.plan) for unit in self._units.values()):
            self._refuse(connection, PeerEventKind.DENIED, now)
            return False
        if len(self._connections) >= self._most_connections() and not self._make_room(now):
            self._refuse(connection, PeerEventKind.FULL, now)
            return False
        self._connections[connection] = None
        since, until = self._gap
        if connection.established <= until + SETTLING:
            connection.wait(min(since, connection.established), until)
        self._admit(connection, now, "")
        self._count()
        self._observe(PeerEvent(PeerEventKind.CONNECTED, connection.peer, names_of(connection.accesses)))
        return True

    def disconnected(self, connection: _Connection) -> None:
        """A connection has ended; called once or more for each."""
        if connection not in self._connections:
            return
        del self._connections[connection]
        names = names_of(connection.accesses)
        now = clock.now()
        accesses, connection.accesses = connection.accesses, {}
        connection.session.serve({})
        for cell, requester in writers_of(accesses):
            cell.writer_disconnected(requester, now, connection.reason)
        self._count()
        self._observe(PeerEvent(PeerEventKind.DISCONNECTED, connection.peer, names, connection.reason))

    # -- inside ---------------------------------------------------------------------------------------------------

    def _admit(
        self,
        connection: _Connection,
        now: float,
        reason: str,
        successors: Mapping[Cell, Cell] = MappingProxyType({}),
    ) -> bool:
        """Give the connection the units its address may reach; returns whether there is any.

        Writers that it is both before and after stay connected throughout.
        """
        address = connection.address
        accesses = {
            number: Access(
                unit, Requester(writer_of(address, unit.plan.writers), str(address), connection.number)
            )
            for number, unit in self._units.items()
            if address is not None and may_connect(address, unit.plan)
        }
        before, after = succeeded(writers_of(connection.accesses), successors), writers_of(accesses)
        connection.accesses = accesses
        connection.session.serve(accesses)
        for cell, requester in after:
            if (cell, requester) not in before:
                cell.writer_connected(requester, now, connection.peer)
        for cell, requester in before:
            if (cell, requester) not in after:
                cell.writer_disconnected(requester, now, reason)
        return bool(accesses)

    def _refuse(self, connection: _Connection, kind: PeerEventKind, now: float) -> None:
        connection.abort(kind.value)
        repeats = self._denials.repeats(f"{kind.name} {connection.address}", now)
        if repeats is not None:
            self._observe(PeerEvent(kind, connection.peer, reason=kind.value, repeats=repeats))

    def _make_room(self, now: float) -> bool:
        """Close the connection that was unused longest, if any is unused and owns nothing (TCP guide, 4.2.2)."""
        unused = [
            connection
            for connection in self._connections
            if now - connection.last_request >= UNUSED_AFTER and not hold_anything(connection.accesses)
        ]
        if not unused:
            return False
        oldest = min(unused, key=lambda connection: connection.last_request)
        oldest.abort("made room for a new connection")
        self.disconnected(oldest)
        return True

    def _most_connections(self) -> int:
        return max((unit.plan.connections for unit in self._units.values()), default=0)

    def _idle_timeout(self) -> float | None:
        timeouts = [unit.plan.idle_timeout for unit in self._units.values()]
        limited = [timeout for timeout in timeouts if timeout is not None]
        return max(limited) if limited and len(limited) == len(timeouts) else None

    def _sweep(self) -> None:
        self.turns += 1
        now = clock.now()
        idle = self._idle_timeout()
        for connection in list(self._connections):
            if connection.stalled_since is not None and now - connection.stalled_since > STALLED_AFTER:
                connection.abort(f"did not read its answers for {STALLED_AFTER:g} s")
            elif (
                idle is not None
                and now - connection.last_request > idle
                and not hold_anything(connection.accesses)
            ):
                connection.abort(f"no request for {idle:g} s")
        delay = _SWEEP if idle is None else min(_SWEEP, idle / 4)
        self._sweeper = asyncio.get_running_loop().call_later(delay, self._sweep)

    def _count(self) -> None:
        for unit in self._units.values():
            unit.cell.health.modbus_connections = len(self._connections)

    def _sockets(self) -> tuple[Any, ...]:
        transport = self._server.transport if self._server is not None else None
        return tuple(cast("asyncio.Server", transport).sockets) if transport is not None else ()
