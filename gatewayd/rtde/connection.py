"""One connection to a controller, from its first byte to its loss; `gatewayd.rtde.client` makes one after another."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import monotonic
from typing import ClassVar, Protocol, cast

from gatewayd.rtde.claims import HandshakeError
from gatewayd.rtde.codec import ClientProtocol, ProtocolError
from gatewayd.rtde.loss import Loss, LossReason, connection_failure
from gatewayd.rtde.messages import ControllerMessage, DataPackage, ExecutableMessage, TextMessage
from gatewayd.rtde.negotiation import TIMESTAMP, Event, Negotiation, Session, State, Wishes
from gatewayd.rtde.pace import Pace, Statistics
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.types import DataType

__all__ = ["ClientHandler", "Connection", "Tolerances"]

_TIMESTAMP = struct.Struct(">d")
_FIRST_CLAIM_RETRY = 0.1
_MEASURE_EVERY = 1.0
_PERIODS_OF_PATIENCE = 5
_GOODBYE = 0.2


class ClientHandler(Protocol):
    """What the user of a client is told, by synchronous calls from the event loop. They must not block.

    An exception from one of them ends the client: `RtdeClient.run` raises it.
    """

    def session_started(self, session: Session) -> None:
        """The set-up is complete; values follow."""

    def values(self, values: tuple[Scalar, ...], now: float) -> None:
        """A package, flat in the order of `Session.outputs`, received at `now` (monotonic seconds)."""

    def inputs_changed(self, session: Session) -> None:
        """Inputs that were in use have been claimed; recipes of the former session object are void."""

    def session_lost(self, loss: Loss) -> None:
        """A session has ended, or an attempt at one has failed. The client goes on by itself."""

    def text(self, message: TextMessage) -> None:
        """The controller has sent a text."""


@dataclass(frozen=True, slots=True)
class Tolerances:
    """How long a connection waits, in seconds, and how much it buffers, in bytes."""

    handshake: float
    """For each answer."""
    data: float
    """Between packages; five periods at least."""
    first_data: float
    """For the first package: until the safety set-up is confirmed a controller sends none."""
    claim_retry: float
    """Between attempts to claim inputs in use; the first ones come quicker."""
    write_buffer: int
    """Unsent bytes at which the connection is given up."""


class Connection(asyncio.Protocol):
    """Sockets to negotiation and back. `done` becomes the loss, or the exception of a handler."""

    def __init__(
        self,
        address: str,
        wishes: Wishes,
        tolerances: Tolerances,
        handler: ClientHandler,
        statistics: Statistics,
    ) -> None:
        loop = asyncio.get_running_loop()
        self.done: asyncio.Future[Loss] = loop.create_future()
        """How the connection ended."""
        self.session: Session | None = None
        """What was agreed; None before the set-up is complete and after the end."""
        self.started_at: float | None = None
        """When the set-up was complete."""
        self._loop = loop
        self._address = address
        self._tolerances = tolerances
        self._handler = handler
        self._statistics = statistics
        self._codec = ClientProtocol()
        self._negotiation = Negotiation(wishes)
        self._transport: asyncio.Transport | None = None
        self._lost = loop.create_future()
        self._waiters: list[asyncio.Future[None]] = []
        self._deadline: asyncio.TimerHandle | None = None
        self._check: asyncio.TimerHandle | None = None
        self._retry: asyncio.TimerHandle | None = None
        self._retry_delay = _FIRST_CLAIM_RETRY
        self._outputs = Recipe((), ())
        self._clocked = False
        self._period = 0.0
        self._pace: Pace | None = None
        self._patience = tolerances.first_data
        self._heard = 0.0
        self._measured = 0.0

    @property
    def state(self) -> State:
        """How far the negotiation has come."""
        return self._negotiation.state

    # what users do

    def send(self, key: str, values: Sequence[Scalar]) -> bool:
        """Send the flat values of the claimed recipe `key` in one package; False if there is no such recipe now.

        Never waits. ValueError if a value does not fit its type.
        """
        claimed = self.session.inputs.get(key) if self.session is not None else None
        if claimed is None or self.done.done():
            return False
        self._write(DataPackage(claimed.id, claimed.recipe.pack(values)))
        self._statistics.writes += 1
        return not self.done.done()

    async def pause(self) -> None:
        """Have the output paused; returns when the controller has answered or the connection is lost."""
        await self._ask(self._negotiation.pause())

    async def resume(self) -> None:
        """Have the output resumed; returns when it is or the connection is lost."""
        await self._ask(self._negotiation.resume())

    async def close(self) -> None:
        """Let what was sent reach the controller, then close. No handler is called any more."""
        self._end()
        self.done.cancel()
        transport = self._transport
        if transport is None or self._lost.done():
            return
        try:
            if not transport.is_closing():
                transport.write_eof()
                await asyncio.wait((self._lost,), timeout=_GOODBYE)
        finally:
            transport.abort()

    # what asyncio calls

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See asyncio.Protocol."""
        self._transport = cast("asyncio.Transport", transport)
        self._request(self._negotiation.begin())
        self._watch()

    def data_received(self, data: bytes) -> None:
        """See asyncio.Protocol."""
        try:
            self._receive(data)
        except Exception as error:  # noqa: BLE001  asyncio would log it and go on; so `run` raises it
            self._end()
            if not self.done.done():
                self.done.set_exception(error)

    def connection_lost(self, exc: Exception | None) -> None:
        """See asyncio.Protocol."""
        self._lost.set_result(None)
        self._conclude(connection_failure(exc if isinstance(exc, OSError) else None, self._address))

    # messages

    def _receive(self, data: bytes) -> None:
        now = monotonic()
        packages: list[DataPackage] = []
        failure: ProtocolError | None = None
        try:
            for message in self._codec.receive(data):
                if self.done.done():
                    return
                if type(message) is DataPackage:
                    packages.append(message)
                    if self._negotiation.running:
                        continue
                self._take(message)
        except ProtocolError as error:
            failure = error
        if packages and self._pace is not None and not self.done.done():
            failure = self._deliver(packages, now) or failure
        if failure is not None:
            self._fail(LossReason.PROTOCOL, f"what the controller sent is not RTDE: {failure}")

    def _take(self, message: ControllerMessage) -> None:
        if isinstance(message, TextMessage):
            self._handler.text(message)
            return
        try:
            step = self._negotiation.handle(message)
        except HandshakeError as error:
            self._fail(LossReason.HANDSHAKE, str(error))
            return
        if step.send is not None:
            self._request(step.send)
        elif not self._negotiation.waiting:
            self._disarm()
        if self.done.done():
            return
        if self._negotiation.claims.exhausted:
            self._give_up_recipes()
        elif step.event is not None:
            self._EVENTS[step.event](self)

    def _deliver(self, packages: list[DataPackage], now: float) -> ProtocolError | None:
        pace = self._pace
        assert pace is not None
        self._heard = now
        self._patience = max(self._tolerances.data, _PERIODS_OF_PATIENCE * self._period)
        newest = packages.pop()
        try:
            values = self._outputs.unpack(newest.payload)
        except ProtocolError as error:
            return error
        for package in packages:
            self._statistics.overtaken += 1
            if self._clocked and len(package.payload) >= _TIMESTAMP.size:
                pace.package(_TIMESTAMP.unpack_from(package.payload)[0], now)
        last = pace.timestamp
        if self._clocked and not pace.package(values[0], now):
            text = (
                f"the controller's clock went from {last} s to {values[0]} s: its RTDE service has restarted"
            )
            self._fail(LossReason.RESTARTED, text)
            return None
        self._handler.values(values, now)
        return None

    def _started(self) -> None:
        now = monotonic()
        session = self.session = self._negotiation.session()
        self.started_at = self._heard = self._measured = now
        self._statistics.sessions += 1
        self._outputs = session.outputs
        self._clocked = session.outputs.names[0] == TIMESTAMP and session.outputs.types[0] is DataType.DOUBLE
        self._period = session.period
        self._pace = Pace(session.period, self._statistics, now)
        self._schedule_retry()
        self._handler.session_started(session)

    def _inputs_changed(self) -> None:
        self.session = self._negotiation.session()
        self._handler.inputs_changed(self.session)

    def _pause_answered(self) -> None:
        self._heard = monotonic()
        for waiter in self._waiters:
            if not waiter.done():
                waiter.set_result(None)
        self._waiters.clear()

    _EVENTS: ClassVar[dict[Event, Callable[[Connection], None]]] = {
        Event.STARTED: _started,
        Event.INPUTS_CHANGED: _inputs_changed,
        Event.PAUSED: _pause_answered,
        Event.RESUMED: _pause_answered,
    }

    # sending

    def _write(self, message: ExecutableMessage) -> None:
        transport = self._transport
        assert transport is not None
        transport.write(self._codec.send(message))
        waiting = transport.get_write_buffer_size()
        if waiting > self._tolerances.write_buffer:
            self._fail(
                LossReason.CONGESTED, f"the controller does not take what is sent: {waiting} bytes wait"
            )

    def _request(self, message: ExecutableMessage) -> None:
        self._write(message)
        self._disarm()
        if not self.done.done():
            self._deadline = self._loop.call_later(self._tolerances.handshake, self._unanswered)

    async def _ask(self, message: ExecutableMessage | None) -> None:
        if message is None or self.done.done():
            return
        waiter: asyncio.Future[None] = self._loop.create_future()
        self._waiters.append(waiter)
        self._request(message)
        await waiter

    # clocks

    def _disarm(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _unanswered(self) -> None:
        what = self._negotiation.awaited
        self._fail(LossReason.UNANSWERED, f"{what} did not come within {self._tolerances.handshake:g} s")

    def _watch(self) -> None:
        self._statistics.turns += 1
        now = monotonic()
        silence = now - self._heard
        if self._negotiation.running and silence > self._patience:
            first = self._pace is None or self._pace.timestamp is None
            hint = ": is the robot powered and its safety set-up confirmed?" if first else ""
            self._fail(LossReason.SILENT, f"no data from the controller for {silence:.1f} s{hint}")
            return
        if self._pace is not None and now - self._measured >= _MEASURE_EVERY:
            self._pace.measure(now)
            self._measured = now
        self._check = self._loop.call_later(min(self._tolerances.data / 4, _MEASURE_EVERY / 2), self._watch)

    def _schedule_retry(self) -> None:
        if self._negotiation.claims.retriable and not self.done.done():
            delay = min(self._retry_delay, self._tolerances.claim_retry)
            self._retry_delay = 2 * delay
            self._retry = self._loop.call_later(delay, self._retry_claims)

    def _retry_claims(self) -> None:
        request = self._negotiation.retry_claims()
        if self._negotiation.claims.exhausted:
            self._give_up_recipes()
            return
        if request is not None:
            self._request(request)
        self._schedule_retry()

    # ends

    def _give_up_recipes(self) -> None:
        self._fail(
            LossReason.RECIPES, "all 255 input recipes of the connection are used up: a new one is opened"
        )

    def _fail(self, reason: LossReason, text: str) -> None:
        self._conclude(Loss(reason, f"{self._address}: {text}"))
        if self._transport is not None:
            self._transport.abort()

    def _conclude(self, loss: Loss) -> None:
        self._end()
        if not self.done.done():
            self.done.set_result(loss)

    def _end(self) -> None:
        """Stop everything that could still call a handler."""
        self.session = None
        for handle in (self._deadline, self._check, self._retry):
            if handle is not None:
                handle.cancel()
        self._pause_answered()
