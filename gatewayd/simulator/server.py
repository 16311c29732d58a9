"""The simulated controller on a TCP port: sockets, the clock that drives its cycles, and nothing else.

The cycle counter follows the clock, at its speed or another. A cycle that comes late is made up for by shortened ones,
never by a burst; what is more than `MAKE_UP` cycles late is skipped, packages and all. The clock of a stepped
controller stands still: the test says when a cycle passes.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import socket
from collections.abc import Callable
from types import TracebackType
from typing import Protocol, Self, cast

from gatewayd.rtde.codec import ProtocolError
from gatewayd.simulator.acknowledging import Acknowledging
from gatewayd.simulator.clock import EARLY, ScaledClock, SimulatorClock, SteppedClock
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.dashboard_server import DashboardServer
from gatewayd.simulator.faults import DroppedError, Faults, Mangler
from gatewayd.simulator.line import OutgoingLine
from gatewayd.simulator.session import SimulatorSession
from gatewayd.simulator.store import Scalar

MAKE_UP = 25
"""Cycles of lateness that are made up for."""
MAX_CONNECTIONS = 16
"""Clients served at a time by default."""
NOT_STEPPED = "time follows the clock here; a stepped simulator has steps (--stepped, stepped=True)"
"""Why there are no steps."""

_SHORTEST_CYCLE = 0.75  # of a period, before the timer's error
_TIMER_ERROR = 0.0005  # epoll rounds up to 1 ms: aiming this much early spreads the error evenly
_SHORTEST_TICK = 0.001  # seconds: shorter cycles, of a raised speed, are run several at a time
_IDLE = 0.01  # seconds between cycles while nobody is connected
_SEND_BUFFER = 65536
_MOST_UNSENT = 1 << 18  # replies that a client has not fetched
_DOWN = 0.2  # seconds a restart takes, of the real clock: nobody can connect meanwhile, and nothing happens
_log = logging.getLogger(__name__)


class CycleFollower(Protocol):
    """What happens to a robot by itself, in step with its cycles."""

    def begin(self) -> None:
        """The controller has been started, or has booted again."""

    def follow(self, cycle: int) -> None:
        """The controller has run its cycle number `cycle`."""

    async def settle(self) -> None:
        """Returns when all that has begun is done."""

    def close(self) -> None:
        """The controller has been stopped."""


class SimulatedController:
    """Serves one `Controller`; an asynchronous context manager, or `start` and `stop`.

    `port` 0 takes a free one, which is kept over `stop` and `start`. OSError if the address cannot be had. `speed` is
    the share of the clock's speed at which its time passes; `stepped`: it passes only by `step`. ValueError for both.
    """

    def __init__(
        self,
        controller: Controller | None = None,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        connections: int = MAX_CONNECTIONS,
        speed: float = 1.0,
        stepped: bool = False,
    ) -> None:
        if not 0 < speed < math.inf or (stepped and speed != 1.0):
            message = f"a speed of {speed!r}: it has to be more than 0, and a stepped controller has none"
            raise ValueError(message)
        self.controller = controller or Controller()
        self.host = host
        self.port = port
        """The TCP port; once started the real one."""
        self.speed = speed
        """Seconds of the controller for each of the clock."""
        self.stepped = stepped
        """Whether time passes by `step` alone."""
        self._steps = SteppedClock(self.controller.rate) if stepped else None
        self.clock: SimulatorClock = self._steps or ScaledClock(speed)
        """By which delays, pauses and lingering claims count."""
        self.follower: CycleFollower | None = None
        """What happens by itself; to be set before the start."""
        self.dashboard: DashboardServer | None = None
        """Its dashboard server; to be set before the start."""
        self.ended: Callable[[], None] | None = None
        """Called when there is nothing left to show: at the end of a recording."""
        self.refused = 0
        """Connections turned away because there were too many."""
        self.malformed = 0
        """Connections closed for bytes that are no packages."""
        self.overflowed = 0
        """Connections closed because the client did not read."""
        self._most = connections
        self._connections: dict[int, _Connection] = {}
        self._number = 0
        self._server: asyncio.Server | None = None
        self._ticking: asyncio.TimerHandle | None = None
        self._boot_at: int | None = None
        self._restarting: asyncio.Task[None] | None = None
        self._next = 0.0
        self._paused_until = -math.inf

    async def __aenter__(self) -> Self:
        try:
            await self.start()
        except OSError:
            await self._close()
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.stop()

    @property
    def started(self) -> bool:
        """Whether it has listened, its dashboard server as well."""
        return self._server is not None and (self.dashboard is None or self.dashboard.started)

    @property
    def has_port(self) -> bool:
        """Whether it has listened for RTDE clients."""
        return self._server is not None

    @property
    def clients(self) -> int:
        """Clients connected now."""
        return len(self._connections)

    @property
    def streaming(self) -> bool:
        """Whether a client has started its output recipe."""
        return any(connection.streaming for connection in self._connections.values())

    @property
    def faults(self) -> Faults:
        """The controller's fault switches."""
        return self.controller.faults

    async def start(self) -> None:
        """Listen, and let the cycles run."""
        await self._listen()
        loop = asyncio.get_running_loop()
        if self.faults.boot_restart is not None:
            self._boot_at = self.controller.cycle + round(self.faults.boot_restart * self.controller.rate)
        if self.follower is not None:
            self.follower.begin()
        self._next = loop.time()
        if not self.stepped:
            self._tick()

    async def stop(self) -> None:
        """Close everything. The variables keep their values for the next `start`."""
        if self._ticking is not None:
            self._ticking.cancel()
        if self._restarting is not None:
            self._restarting.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._restarting
        if self.follower is not None:
            self.follower.close()
        await self._close()

    async def restart(self) -> None:
        """Boot again: close every connection, listen anew with timestamp and registers from the beginning."""
        _log.info("restarting: timestamp and registers start again")
        await self._close()
        await asyncio.sleep(_DOWN)
        self.controller.restart()
        if self.follower is not None:
            self.follower.begin()
        await self._listen()

    async def step(self, cycles: int = 1) -> None:
        """Let that many control cycles pass, one by one; RuntimeError unless it is stepped.

        Each begins when every client has room for its package, so that none is skipped: a client that does not read
        is waited for as long as `overflow_close` says, in seconds of the real clock, and then closed. While the
        controller is paused they pass without it.
        """
        if self._steps is None:
            raise RuntimeError(NOT_STEPPED)
        for _ in range(cycles):
            for connection in list(self._connections.values()):
                await connection.drained()
            paused = self.paused
            self._steps.step()
            if not paused:
                self._run(1)
            if self.follower is not None:
                await self.follower.settle()
            await asyncio.sleep(0)  # lets what clients have sent come in

    def pause(self, seconds: float) -> None:
        """Stand still for a while, as a halted virtual machine does: nothing is sent, read or counted.

        The timestamp goes on where it stopped, and lags by that much from then on. Seconds are those of the clock.
        """
        self._paused_until = self.clock.now + seconds
        self.clock.call_at(self._paused_until, self._read_again)
        for connection in self._connections.values():
            connection.read(on=False)

    @property
    def paused(self) -> bool:
        """Whether it stands still."""
        return self.clock.now + EARLY < self._paused_until

    def drop_clients(self) -> int:
        """Cut every connection; returns how many there were."""
        connections = list(self._connections.values())
        for connection in connections:
            connection.abort("dropped on request")
        return len(connections)

    def say(self, message: str) -> None:
        """Send a text message (a warning) to every client."""
        for connection in self._connections.values():
            connection.say(message)

    def raw(self, data: bytes) -> None:
        """Send these bytes, whatever they are, to every client."""
        for connection in self._connections.values():
            connection.raw(data)

    def get(self, field: str) -> tuple[Scalar, ...] | Scalar:
        """A field's value now: a number, or a tuple for a vector. KeyError if there is no such field."""
        values = self.controller.get(field)
        return values if len(values) > 1 else values[0]

    def set(self, field: str, *values: Scalar) -> None:
        """Write any field, as the robot would; see `Controller.set`."""
        self.controller.set(field, values)

    def _read_again(self) -> None:
        if not self.paused:
            for connection in self._connections.values():
                connection.read(on=True)

    async def _listen(self) -> None:
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._accept, self.host, self.port, start_serving=False)
        await self._server.start_serving()  # only now: `enter` asks it
        self.port = self._server.sockets[0].getsockname()[1]
        if self.dashboard is not None:
            await self.dashboard.start()

    async def _close(self) -> None:
        if self.dashboard is not None:
            await self.dashboard.stop()
        if self._server is not None:
            # asyncio (3.11) leaks a connection that it accepted and has not handed on when its server is closed.
            for listening in self._server.sockets:
                asyncio.get_running_loop().remove_reader(listening.fileno())
            await asyncio.sleep(0)
            self._server.close()
        for connection in list(self._connections.values()):
            connection.abort("controller stops")
        await asyncio.sleep(0)  # lets the transports report the loss, which releases the claims

    def _accept(self) -> asyncio.Protocol:
        self._number += 1
        return _Connection(self, self._number)

    def enter(self, number: int, connection: _Connection) -> bool:
        """Note a new connection; False if there are too many, or if it was accepted just before the end."""
        if self._server is None or not self._server.is_serving():
            return False
        if len(self._connections) >= self._most:
            self.refused += 1
            return False
        if not self._connections:  # from idle to full rate
            self._schedule(asyncio.get_running_loop().time())
        self._connections[number] = connection
        return True

    def leave(self, number: int) -> None:
        """Forget a connection."""
        self._connections.pop(number, None)

    def _tick(self) -> None:
        loop = asyncio.get_running_loop()
        now = loop.time()
        period = 1 / (self.controller.rate * self.speed)
        batch = max(1, int(_SHORTEST_TICK / period))
        late = now - self._next
        skipped = 0
        if late > (MAKE_UP if self._connections else 1) * batch * period:
            skipped = int(late / period)
        if not self.paused:
            self._run(1 + skipped)
            for _ in range(batch - 1):
                self._run(1)
        self._next += (batch + skipped) * period
        pause = _SHORTEST_CYCLE * batch * period if self._connections else _IDLE
        self._schedule(max(self._next, now + pause))

    def _run(self, cycles: int) -> None:
        """One control cycle, `cycles` after the last, and its packages."""
        controller, now = self.controller, asyncio.get_running_loop().time()
        controller.advance(cycles)
        if self.follower is not None:
            self.follower.follow(controller.cycle)
        for connection in list(self._connections.values()):
            connection.cycle(now)
        if self._boot_at is not None and controller.cycle >= self._boot_at:
            self._boot_at = None
            self._restarting = asyncio.get_running_loop().create_task(self.restart())

    def _schedule(self, when: float) -> None:
        if self._ticking is not None:
            self._ticking.cancel()
        if self.stepped:
            return
        self._ticking = asyncio.get_running_loop().call_at(when - _TIMER_ERROR, self._tick)


class _Connection(asyncio.Protocol):
    """One client's socket."""

    def __init__(self, server: SimulatedController, number: int) -> None:
        self._server = server
        self._number = number
        self._mangler = Mangler(server.faults, number)
        self._blocked_since: float | None = None
        self._acknowledging = Acknowledging()
        self._room = asyncio.Event()
        self._room.set()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        self._socket = cast("socket.socket", transport.get_extra_info("socket"))
        self._line = OutgoingLine(self._transport, self._server.faults, self._server.clock)
        peer = transport.get_extra_info("peername") or ("?", 0)
        self._session = SimulatorSession(
            self._server.controller, f"client {self._number} ({peer[0]}:{peer[1]})"
        )
        if not self._server.enter(self._number, self):
            self.abort("turned away")
            return
        # A small send buffer makes it show soon that a client does not read.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if self._server.stepped:
            self._transport.set_write_buffer_limits(0)
        self._write(self._session.greeting())
        self.read(on=not self._server.paused)
        _log.info("%s connected", self._session)

    def data_received(self, data: bytes) -> None:
        # ur_rtde sends a request in two segments without NODELAY: each waits for the acknowledgement of the one before.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
        try:
            replies = self._session.receive(data)
        except ProtocolError as error:
            self._server.malformed += 1
            self.abort(str(error))
            return
        except DroppedError as fault:
            self.abort(str(fault))
            return
        self._write(replies)

    def pause_writing(self) -> None:
        self._room.clear()

    def resume_writing(self) -> None:
        self._room.set()

    def connection_lost(self, exc: Exception | None) -> None:
        self._server.leave(self._number)
        self._room.set()
        self._line.close()
        linger = self._server.faults.linger
        if linger:
            clock = self._server.clock
            clock.call_at(clock.now + linger, self._session.close)
        else:
            self._session.close()
        _log.info("%s gone", self._session)

    @property
    def streaming(self) -> bool:
        """Whether the client has started its output recipe."""
        return self._session.streaming

    async def drained(self) -> None:
        """Returns when everything has left for the client, or when it has been closed for not reading."""
        limit = self._server.faults.overflow_close
        try:
            async with asyncio.timeout(limit):
                await self._room.wait()
        except TimeoutError:
            self._overflow(f"has not read for {limit:g} s")

    def abort(self, reason: str) -> None:
        """Cut the connection at once."""
        _log.warning("%s: %s; connection closed", self._session, reason)
        self._transport.abort()

    def say(self, message: str) -> None:
        """Send a text message."""
        self._write(self._session.text(message))

    def raw(self, data: bytes) -> None:
        """Send bytes as they are."""
        self._write(data)

    def read(self, *, on: bool) -> None:
        """Take in what the client sends, or leave it in the socket."""
        if self._transport.is_closing():
            return
        if on:
            self._transport.resume_reading()
        else:
            self._transport.pause_reading()

    def cycle(self, now: float) -> None:
        """Send the package that is due now, or skip it while the client does not read."""
        try:
            package = self._session.package()
        except DroppedError as fault:
            self.abort(str(fault))
            return
        if self._transport.is_closing() or self._silent(now):
            return
        if self._transport.get_write_buffer_size():
            self._blocked(now)
            return
        self._blocked_since = None
        if self._server.faults.mangles:
            package = self._mangler.mangle(package) if package else self._mangler.flush()
        if package:
            self._line.write(package)

    def _silent(self, now: float) -> bool:
        """Drop a client whose machine acknowledges nothing: it has lost its power or cable.

        The kernel could do it (TCP_USER_TIMEOUT), but it looks only when it repeats a packet, at pauses that double.
        """
        limit = self._server.faults.overflow_close
        if limit is None or not self._acknowledging.silent(self._socket, now, limit):
            return False
        self._overflow(f"has acknowledged nothing for {limit:g} s")
        return True

    def _blocked(self, now: float) -> None:
        limit = self._server.faults.overflow_close
        if self._blocked_since is None:
            self._blocked_since = now
        elif limit is not None and now - self._blocked_since > limit:
            self._overflow(f"has not read for {limit:g} s")

    def _write(self, data: bytes) -> None:
        if not data or self._transport.is_closing():
            return
        self._line.write(self._mangler.flush() + data)
        if self._transport.get_write_buffer_size() > _MOST_UNSENT:
            self._overflow("does not fetch its answers")

    def _overflow(self, reason: str) -> None:
        self._server.overflowed += 1
        self.abort(reason)
