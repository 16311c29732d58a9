"""The client's side of one MQTT connection (3.1.1 and 5.0): packets in, packets out, and pings. Pure.

| packet of the broker | what is done |
|---|---|
| CONNACK | `accepted`, or `refused` with its words; nothing else may come before it |
| PUBLISH with QoS 0, with QoS 1 | `message`; the latter is acknowledged first |
| SUBACK | `subscribed` for each topic |
| PUBACK, UNSUBACK, PINGRESP | noted |
| DISCONNECT (5.0) | ConnectionResetError with its words |
| any other, or one that is not as it has to be | MqttProtocolError |

Nothing is sent again: the session ends with the connection.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from gatewayd.mqtt import outgoing
from gatewayd.mqtt.messages import MQTT_5, BrokerSettings, Message
from gatewayd.mqtt.reasons import FAILED, connect_reason, reason
from gatewayd.mqtt.wire import MAXIMUM_PACKET_SIZE, SERVER_KEEPALIVE, MqttProtocolError, PacketReader

_CONNACK, _PUBLISH, _PUBACK, _SUBACK, _UNSUBACK, _PINGRESP, _DISCONNECT = 0x2, 0x3, 0x4, 0x9, 0xB, 0xD, 0xE
_RETAIN, _QOS_1, _QOS_2, _DUP = 0x1, 0x2, 0x4, 0x8
_MAX_NUMBER: Final = 0xFFFF
MAX_PENDING: Final = 1000
"""Subscriptions without an answer; a broker that owes more does not work."""


class Engine:
    """After an error it is used no more."""

    def __init__(
        self,
        settings: BrokerSettings,
        password: str | None,
        will: Message | None,
        write: Callable[[bytes], object],
    ) -> None:
        self.accepted: Callable[[], object] = lambda: None
        """Called when the broker takes the connection."""
        self.refused: Callable[[str], object] = lambda _why: None
        """Called when it does not, with its words."""
        self.message: Callable[[str, bytes, bool, bool], object] = lambda *_each: None
        """Called with topic, payload, and whether it was retained or is sent again."""
        self.subscribed: Callable[[Sequence[str], str], object] = lambda *_each: None
        """Called with topics and why the broker refuses them; empty: it does not."""
        self._settings = settings
        self._is_5 = settings.version == MQTT_5
        self._password = password
        self._will = will
        self._write = write
        self._keepalive = float(settings.keepalive)
        self._max_size: int | None = None
        """Bytes of a packet that the broker takes; None: it has not said."""
        self._is_accepted = False
        self._number = 0
        self._pending: dict[int, tuple[str, ...]] = {}
        self._is_sent = self._is_heard = True
        """Whether anything was, since the last look."""
        self._sent_at = self._heard_at = 0.0
        self._pinged_at: float | None = None

    def begin(self) -> None:
        """Say CONNECT."""
        self._send(outgoing.connect(self._settings, self._password, self._will))

    def receive(self, packet: bytes) -> None:
        """Take one whole packet. Raises MqttProtocolError and ConnectionResetError, whatever its bytes are."""
        self._is_heard = True
        kind, flags = packet[0] >> 4, packet[0] & 0x0F
        reader = PacketReader.of(packet)
        if kind == _CONNACK and not flags and not self._is_accepted:
            self._connack(reader)
        elif not self._is_accepted:
            raise MqttProtocolError("a packet before the connection was accepted")
        elif kind == _PUBLISH:
            self._publish(flags, reader)
        elif kind == _SUBACK and not flags:
            self._suback(reader)
        elif kind in (_PUBACK, _UNSUBACK) and not flags:
            reader.number(2)
        elif kind == _PINGRESP and not flags and not reader.left:
            self._pinged_at = None
        elif kind == _DISCONNECT and not flags and self._is_5:
            why = reason(reader.number(1)) if reader.left else "without a reason"
            raise ConnectionResetError(f"the broker ends the connection: {why}")
        else:
            raise MqttProtocolError(f"a packet that no broker sends: {packet[:1].hex()}")

    def gap(self, seconds: float) -> None:
        """The process stood still: the broker had no less time for its answer."""
        if self._pinged_at is not None:
            self._pinged_at += seconds

    def tick(self, now: float) -> None:
        """Send a ping when it is due. Raises TimeoutError where the broker has not answered the last one."""
        if self._is_sent:
            self._sent_at, self._is_sent = now, False
        if self._is_heard:
            self._heard_at, self._is_heard = now, False
        if self._pinged_at is not None:
            if now - self._pinged_at >= self._keepalive:
                raise TimeoutError("the broker does not answer")
        elif now - min(self._sent_at, self._heard_at) >= self._keepalive:
            self._send(outgoing.PINGREQ)
            self._pinged_at = now

    def publish(self, message: Message) -> None:
        """Send a message. Raises ValueError for a topic that cannot be, and for more than the broker takes."""
        number = self._next_number() if message.qos else 0
        packet = outgoing.publish(self._settings.version, message, number)
        if self._max_size is not None and len(packet) > self._max_size:
            raise ValueError(f"a message of {len(packet)} bytes, and the broker takes {self._max_size}")
        self._send(packet)

    def subscribe(self, topics: Sequence[str], qos: int) -> None:
        """Ask for messages."""
        number = self._next_number()
        self._pending[number] = tuple(topics)
        self._send(outgoing.subscribe(self._settings.version, topics, qos, number))

    def unsubscribe(self, topics: Sequence[str]) -> None:
        """Ask for them no more."""
        self._send(outgoing.unsubscribe(self._settings.version, topics, self._next_number()))

    def end(self) -> None:
        """Say DISCONNECT: the broker forgets the will."""
        self._send(outgoing.DISCONNECT)

    # -- inside ------------------------------------------------------------------------------------------------------

    def _send(self, packet: bytes) -> None:
        self._is_sent = True
        self._write(packet)

    def _next_number(self) -> int:
        if len(self._pending) >= MAX_PENDING:
            raise ValueError("the broker answers no subscription")
        self._number = self._number % _MAX_NUMBER + 1
        while self._number in self._pending:
            self._number = self._number % _MAX_NUMBER + 1
        return self._number

    def _connack(self, reader: PacketReader) -> None:
        reader.number(1)
        code = reader.number(1)
        if code:
            self.refused(connect_reason(code))
            return
        found = reader.properties() if self._is_5 else {}
        self._max_size = found.get(MAXIMUM_PACKET_SIZE)
        # A broker that wants no pings (0) gets them all the same: they tell us that it is there.
        self._keepalive = min(self._keepalive, float(found.get(SERVER_KEEPALIVE) or self._keepalive))
        self._is_accepted = True
        self.accepted()

    def _publish(self, flags: int, reader: PacketReader) -> None:
        if flags & _QOS_2:
            raise MqttProtocolError("a message with QoS 2, which nobody has subscribed to")
        topic = reader.text()
        if not topic:
            raise MqttProtocolError("a message without a topic")
        if flags & _QOS_1:
            self._send(outgoing.puback(reader.number(2)))
        if self._is_5:
            reader.properties()
        self.message(topic, reader.rest(), bool(flags & _RETAIN), bool(flags & _DUP))

    def _suback(self, reader: PacketReader) -> None:
        topics = self._pending.pop(reader.number(2), None)
        if self._is_5:
            reader.properties()
        if topics is None or reader.left != len(topics):
            raise MqttProtocolError("an answer to no subscription")
        for topic, code in zip(topics, reader.rest(), strict=True):
            self.subscribed((topic,), self._refusal(code))

    def _refusal(self, code: int) -> str:
        if code < FAILED:
            return ""
        return reason(code) if self._is_5 else "refused"
