"""One connection to a broker, from its first byte to its loss: an asyncio protocol around the packets."""

from __future__ import annotations

import asyncio
import socket
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial

from gatewayd.loop import clock
from gatewayd.loop.allowance import Allowance
from gatewayd.mqtt.engine import Engine
from gatewayd.mqtt.messages import BrokerSettings, Message, Received
from gatewayd.mqtt.packets import Oversized, PacketSplitter
from gatewayd.mqtt.waiting import WaitedMessages
from gatewayd.mqtt.wire import MqttProtocolError

_TYPE_AND_QOS, _PUBLISH = 0xF6, 0x30
CLOSED = "the broker has closed the connection"
MAX_UNSENT = 65_536
"""Bytes that wait in us for a slow broker; beyond them nothing is given any more. As many wait in the kernel."""
MAX_TURN = 16
"""Messages that are served before others have their turn: some 2 ms, if each of them is a command."""


class BrokerConnection(asyncio.Protocol):
    """Ends with `lost`, which has the reason in words; everything before is reported by the callbacks."""

    def __init__(
        self, settings: BrokerSettings, password: str | None, will: Message | None, rate: float
    ) -> None:
        """`rate`: messages with QoS 0 a second that are read."""
        loop = asyncio.get_running_loop()
        self.accepted: asyncio.Future[None] = loop.create_future()
        """The broker takes the connection; ConnectionRefusedError with its words otherwise."""
        self.lost: asyncio.Future[str] = loop.create_future()
        self.received: Callable[[Received], object] = lambda _message: None
        self.oversized: Callable[[Oversized], object] = lambda _message: None
        self.subscribed: Callable[[Sequence[str], str], object] = lambda *_each: None
        self.passed: Callable[[bytes, bool], object] | None = None
        """For a trace: bytes, and whether we sent them."""
        self.writable = False
        """Whether the broker takes what it is given."""
        self._loop = loop
        self._engine = Engine(settings, password, will, self._write)
        self._engine.accepted = self._accepted
        self._engine.refused = self._refused
        self._engine.message = self._message
        self._engine.subscribed = self._answered
        self._splitter = PacketSplitter()
        self._allowance = Allowance(int(rate), rate)
        self._unread = 0
        self._transport: asyncio.Transport | None = None
        self._waited = WaitedMessages()
        self._queue: deque[tuple[bytes | Oversized, float]] = deque()
        """What was read and not served yet, with the seconds for which it may have waited in the socket."""
        self._served_waited = 0.0

    @property
    def own_address(self) -> tuple[str, int] | None:
        """Of our end."""
        name = self._transport.get_extra_info("sockname") if self._transport is not None else None
        return (str(name[0]), int(name[1])) if name else None

    # -- called by asyncio -------------------------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Say CONNECT."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        transport.set_write_buffer_limits(high=MAX_UNSENT)
        # Left to itself the kernel takes megabytes for a slow broker, which gets values that are minutes old then.
        transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, MAX_UNSENT // 2)
        self._engine.begin()

    def data_received(self, data: bytes) -> None:
        """Serve what came; a part of it in the next turn of the loop where it is much."""
        now = clock.judged_now()
        if self.lost.done():
            return
        if self.passed is not None:
            self.passed(data, False)
        self._waited.read(len(data))
        waited = self._waited.seconds(now)
        try:
            packets = self._splitter.feed(data)
        except MqttProtocolError as error:
            self.end(f"not MQTT: {error}")
            return
        for packet in packets:
            # One with QoS 1 has to be acknowledged; of these a broker has few under way.
            if (
                isinstance(packet, bytes)
                and packet[0] & _TYPE_AND_QOS == _PUBLISH
                and not self._allowance.take(now)
            ):
                self._unread += 1
            else:
                self._queue.append((packet, waited))
        self._serve()
        if self._queue and self._transport is not None and not self.lost.done():
            self._transport.pause_reading()
            self._loop.call_soon(self._serve_rest)

    def pause_writing(self) -> None:
        """The broker does not take what it is given."""
        self.writable = False

    def resume_writing(self) -> None:
        """It does again."""
        self.writable = self.accepted.done() and not self.lost.done()

    def eof_received(self) -> None:
        """The broker has closed."""
        self.end(self._closed())

    def connection_lost(self, error: Exception | None) -> None:
        """See asyncio."""
        why = getattr(error, "strerror", None) or (str(error) if error else "")
        self.end(why or self._closed())

    # -- called by the client ----------------------------------------------------------------------------------------

    def gap(self, since: float, until: float) -> None:
        """The process stood still: what is read next may have waited."""
        self._waited.gap(since, until)
        self._engine.gap(until - since)
        self._queue = deque((packet, waited + until - since) for packet, waited in self._queue)

    def tick(self) -> None:
        """Pings, and whether they are answered."""
        if self.accepted.done() and not self.lost.done():
            try:
                self._engine.tick(clock.now())
            except TimeoutError as error:
                self.end(str(error))

    def take_unread(self) -> int:
        """How many messages were let pass since the last call, because too many came."""
        unread, self._unread = self._unread, 0
        return unread

    def publish(self, message: Message) -> bool:
        """Send it now; False: it cannot be taken, and was not."""
        if not self.writable or self.lost.done():
            return False
        try:
            self._engine.publish(message)
        except ValueError as error:
            self.end(str(error))
            return False
        return True

    def subscribe(self, topics: Sequence[str], qos: int) -> None:
        """Ask for messages."""
        if topics and self.accepted.done() and not self.lost.done():
            self._ask(partial(self._engine.subscribe, topics, qos))

    def unsubscribe(self, topics: Sequence[str]) -> None:
        """Ask for them no more."""
        if topics and self.accepted.done() and not self.lost.done():
            self._ask(partial(self._engine.unsubscribe, topics))

    def leave(self, reason: str = "the gateway has left") -> None:
        """Say DISCONNECT, so that the broker keeps the will to itself, and close when all was sent."""
        if self.accepted.done() and not self.lost.done():
            self._engine.end()
        if self._transport is not None:
            self._transport.close()
        self.writable = False
        if not self.lost.done():
            self.lost.set_result(reason)

    def end(self, reason: str) -> None:
        """The connection is no more, for this reason."""
        self.writable = False
        if not self.lost.done():
            self.lost.set_result(reason)
        if not self.accepted.done():
            self.accepted.set_exception(ConnectionRefusedError(reason))
            # Whoever waited may be gone.
            self.accepted.exception()
        # One that is closing has something left to send; it ends by itself.
        if self._transport is not None and not self._transport.is_closing():
            self._transport.abort()

    # -- inside ------------------------------------------------------------------------------------------------------

    def _closed(self) -> str:
        """Why a broker may have done so: 3.1.1 has no word for it, and not every broker of 5.0 says the one it has."""
        if not self.accepted.done():
            return CLOSED
        return f"{CLOSED}: it ended, or another client has come with the same client identifier"

    def _serve(self) -> None:
        for _ in range(min(MAX_TURN, len(self._queue))):
            if self.lost.done():
                return
            packet, self._served_waited = self._queue.popleft()
            if isinstance(packet, Oversized):
                self.oversized(packet)
                continue
            try:
                self._engine.receive(packet)
            except MqttProtocolError as error:
                self.end(f"not MQTT: {error}")
            except ConnectionResetError as error:
                self.end(str(error))

    def _ask(self, ask: Callable[[], None]) -> None:
        try:
            ask()
        except ValueError as error:
            self.end(str(error))

    def _serve_rest(self) -> None:
        clock.judged_now()
        self._serve()
        if self._transport is None or self.lost.done():
            self._queue.clear()
        elif self._queue:
            self._loop.call_soon(self._serve_rest)
        else:
            self._transport.resume_reading()

    def _write(self, data: bytes) -> None:
        if self._transport is None or self._transport.is_closing():
            return
        if self.passed is not None:
            self.passed(data, True)
        self._transport.write(data)

    def _accepted(self) -> None:
        if not self.accepted.done():
            self.writable = True
            self.accepted.set_result(None)

    def _refused(self, why: str) -> None:
        self.end(f"the broker refuses the connection: {why}")

    def _answered(self, topics: Sequence[str], why: str) -> None:
        self.subscribed(topics, why)

    def _message(self, topic: str, payload: bytes, retained: bool, again: bool) -> None:
        self.received(Received(topic, payload, retained, again, self._served_waited))
