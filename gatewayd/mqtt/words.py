"""MQTT packets in words, for the reader of a trace (MQTT 3.1.1 and 5.0, section 3).

Which version is spoken only CONNECT says; a trace that began later guesses: in version 5 properties stand before a
payload.
"""

from __future__ import annotations

from typing import Final

from gatewayd.mqtt.messages import MQTT_5, MQTT_311
from gatewayd.mqtt.reasons import FAILED, connect_reason
from gatewayd.mqtt.wire import PROPERTIES, MqttProtocolError, PacketReader, ShortPacketError

_NAMES: Final = (
    "reserved", "CONNECT", "CONNACK", "PUBLISH", "PUBACK", "PUBREC", "PUBREL", "PUBCOMP", "SUBSCRIBE", "SUBACK",
    "UNSUBSCRIBE", "UNSUBACK", "PINGREQ", "PINGRESP", "DISCONNECT", "AUTH",
)  # fmt: skip
_CONNECT, _CONNACK, _PUBLISH, _SUBSCRIBE, _SUBACK = 1, 2, 3, 8, 9
_MAX_PAYLOAD: Final = 200
"""Bytes of a payload that are shown."""


class PacketWords:
    """Remembers the version of one connection."""

    def __init__(self) -> None:
        self._version: int | None = None

    def of(self, packet: bytes) -> str:
        """One whole packet in words. Never raises, whatever its bytes are."""
        kind, flags = packet[0] >> 4, packet[0] & 0x0F
        reader = PacketReader.of(packet)
        try:
            more = self._more(kind, flags, reader)
        except ShortPacketError:
            more = "cut short"
        except MqttProtocolError as error:
            more = f"not MQTT: {error}"
        return f"{_NAMES[kind]} {more}".rstrip()

    def _more(self, kind: int, flags: int, reader: PacketReader) -> str:
        if kind == _CONNECT:
            return self._connect(reader)
        if kind == _CONNACK:
            reader.number(1)
            code = reader.number(1)
            return "accepted" if code == 0 else f"refused: {connect_reason(code)}"
        if kind == _PUBLISH:
            return self._publish(flags, reader)
        if kind in (_SUBSCRIBE, _SUBACK):
            return self._subscription(kind, reader)
        return ""

    def _connect(self, reader: PacketReader) -> str:
        reader.text()
        self._version = reader.number(1)
        flags, keepalive = reader.number(1), reader.number(2)
        if self._version == MQTT_5:
            reader.take(reader.varint())
        client = reader.text()
        spoken = {MQTT_311: "3.1.1", MQTT_5: "5"}.get(self._version, f"level {self._version}")
        clean = "clean session" if flags & 2 else "session kept"
        will = ", with a will" if flags & 4 else ""
        return f"as {client}, MQTT {spoken}, {clean}, keep alive {keepalive} s{will}"

    def _publish(self, flags: int, reader: PacketReader) -> str:
        topic = reader.text()
        qos = flags >> 1 & 3
        if qos:
            reader.number(2)
        if self._version == MQTT_5 or (self._version is None and _has_properties(reader.rest())):
            reader.take(reader.varint())
        marks = [f"QoS {qos}"] if qos else []
        marks += ["retained"] if flags & 1 else []
        marks += ["again"] if flags & 8 else []
        shown = f" ({', '.join(marks)})" if marks else ""
        return f"{topic}{shown}: {_payload(reader.rest())}"

    def _subscription(self, kind: int, reader: PacketReader) -> str:
        reader.number(2)
        if self._version == MQTT_5:
            reader.take(reader.varint())
        if kind == _SUBACK:
            codes = reader.rest()
            refused = sum(code >= FAILED for code in codes)
            return f"{refused} refused" if refused else "granted"
        begin = reader.at
        try:
            return ", ".join(_topics(reader))
        except MqttProtocolError:
            if self._version is not None:
                raise
        reader.at = begin
        reader.take(reader.varint())
        return ", ".join(_topics(reader))


def _topics(reader: PacketReader) -> list[str]:
    topics = []
    while reader.rest():
        topic = reader.text()
        if not topic:
            raise ShortPacketError  # the length of properties was taken for that of a topic
        topics.append(topic)
        reader.number(1)
    return topics


def _has_properties(data: bytes) -> bool:
    """Whether bytes look like the properties of version 5 with something behind them."""
    if not data:
        return False
    length = data[0]
    return length == 0 or (length < len(data) and data[1] in PROPERTIES)


def _payload(data: bytes) -> str:
    if not data:
        return "empty"
    try:
        text = data[:_MAX_PAYLOAD].decode("utf-8")
    except UnicodeDecodeError:
        text = ""
    shown = text if text.isprintable() and text else data[: _MAX_PAYLOAD // 4].hex(" ")
    return shown if len(data) <= _MAX_PAYLOAD else f"{shown}... ({len(data)} bytes)"
