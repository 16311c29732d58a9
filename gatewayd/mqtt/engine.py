"""The packets of one connection by paho-mqtt, without its sockets, threads and clocks: bytes in, bytes out.

paho takes its connection from a method that is not documented, so its version is
restricted to one minor release, and tests/mqtt/test_engine.py pins what is used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from paho.mqtt.client import Client, MQTTMessage
from paho.mqtt.enums import CallbackAPIVersion, MQTTErrorCode, MQTTProtocolVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode
from paho.mqtt.subscribeoptions import SubscribeOptions

from gatewayd.mqtt.messages import MAX_PACKET, MQTT_5, BrokerSettings, Message
from gatewayd.mqtt.packets import MqttProtocolError

_PUBLISH = 0x30
_QOS_2 = 0x04


class _Pipe:
    """What paho takes for its socket."""

    def __init__(self, write: Callable[[bytes], object]) -> None:
        self._write = write
        self._packet = b""
        self._position = 0

    def give(self, packet: bytes) -> None:
        self._packet, self._position = packet, 0

    def recv(self, size: int) -> bytes:
        if self._position >= len(self._packet):
            raise BlockingIOError
        data = self._packet[self._position : self._position + size]
        self._position += len(data)
        return data

    def send(self, data: bytes | bytearray) -> int:
        self._write(bytes(data))
        return len(data)

    def pending(self) -> int:
        return len(self._packet) - self._position

    def setblocking(self, _flag: bool) -> None:
        pass

    def fileno(self) -> int:
        return -1

    def close(self) -> None:
        pass


class _Client(Client):
    """paho's client on a pipe."""

    def __init__(self, pipe: _Pipe, settings: BrokerSettings) -> None:
        is_5 = settings.version == MQTT_5
        super().__init__(
            CallbackAPIVersion.VERSION2,
            client_id=settings.client,
            clean_session=None if is_5 else True,
            protocol=MQTTProtocolVersion.MQTTv5 if is_5 else MQTTProtocolVersion.MQTTv311,
            reconnect_on_failure=False,
        )
        self._pipe = pipe

    def _create_socket(self) -> Any:
        return self._pipe


class Engine:
    """The MQTT side of one connection. After an error it is used no more."""

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
        self._pipe = _Pipe(write)
        self._client = client = _Client(self._pipe, settings)
        self._pending: dict[int, tuple[str, ...]] = {}
        if settings.username:
            client.username_pw_set(settings.username, password)
        if will is not None:
            client.will_set(will.topic, will.payload, will.qos, will.retain)
        client.on_connect = self._on_connect
        client.on_message = self._on_message
        client.on_subscribe = self._on_subscribe
        client.on_disconnect = self._on_disconnect
        self._ended = ""
        self._is_refused = False

    def begin(self) -> None:
        """Say CONNECT: a clean session that ends with the connection, so that nothing is ever kept for us."""
        if self._settings.version == MQTT_5:
            properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call] # paho has types nearly everywhere
            properties.MaximumPacketSize = MAX_PACKET
            properties.SessionExpiryInterval = 0
            self._client.connect(
                "broker", keepalive=self._settings.keepalive, clean_start=True, properties=properties
            )
        else:
            self._client.connect("broker", keepalive=self._settings.keepalive)

    def receive(self, packet: bytes) -> None:
        """Take one whole packet. Raises MqttProtocolError, whatever its bytes are."""
        if packet[0] & 0xF0 == _PUBLISH and packet[0] & _QOS_2:
            raise MqttProtocolError("a message with QoS 2, which nobody has subscribed to")
        self._pipe.give(packet)
        try:
            code = self._client.loop_read()
            self._client.loop_write()
        except Exception as error:  # paho raises what its parsers meet: struct.error, IndexError and others
            raise MqttProtocolError(f"{type(error).__name__}: {error}") from error
        if self._is_refused:
            return
        if code is not MQTTErrorCode.MQTT_ERR_SUCCESS:
            raise MqttProtocolError(self._ended or _words(code))
        if self._ended:
            raise ConnectionResetError(f"the broker ends the connection: {self._ended}")

    def tick(self) -> None:
        """Send a ping when it is due. Raises TimeoutError where the broker has not answered the last one."""
        if self._client.loop_misc() is not MQTTErrorCode.MQTT_ERR_SUCCESS or self._client.socket() is None:
            raise TimeoutError("the broker does not answer")

    def publish(self, message: Message) -> None:
        """Send a message. Raises ValueError for a topic that cannot be."""
        self._client.publish(message.topic, bytes(message.payload), message.qos, message.retain)

    def subscribe(self, topics: Sequence[str], qos: int) -> None:
        """Ask for messages."""
        if self._settings.version == MQTT_5:
            options = SubscribeOptions(qos=qos, retainAsPublished=True)
            _code, number = self._client.subscribe([(topic, options) for topic in topics])
        else:
            _code, number = self._client.subscribe([(topic, qos) for topic in topics])
        if number is not None:
            self._pending[number] = tuple(topics)

    def unsubscribe(self, topics: Sequence[str]) -> None:
        """Ask for them no more."""
        self._client.unsubscribe(list(topics))

    def end(self) -> None:
        """Say DISCONNECT: the broker forgets the will."""
        self._client.disconnect()

    def _on_connect(
        self, _client: Client, _data: object, _flags: object, reason: ReasonCode, _properties: object
    ) -> None:
        if reason.is_failure:
            self._is_refused = True
            self.refused(str(reason))
        else:
            self.accepted()

    def _on_message(self, _client: Client, _data: object, message: MQTTMessage) -> None:
        self.message(message.topic, bytes(message.payload), message.retain, message.dup)

    def _on_subscribe(
        self, _client: Client, _data: object, number: int, reasons: Sequence[ReasonCode], _properties: object
    ) -> None:
        for topic, reason in zip(self._pending.pop(number, ()), reasons, strict=False):
            self.subscribed((topic,), str(reason) if reason.is_failure else "")

    def _on_disconnect(
        self, _client: Client, _data: object, _flags: object, reason: ReasonCode, _properties: object
    ) -> None:
        self._ended = str(reason)


def _words(code: MQTTErrorCode) -> str:
    return code.name.removeprefix("MQTT_ERR_").lower().replace("_", " ")
