"""The packets that a client sends, in MQTT 3.1.1 and 5 (section 3 of both). Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from gatewayd.mqtt.messages import MAX_PACKET, MQTT_5, BrokerSettings, Message
from gatewayd.mqtt.names import WILDCARDS
from gatewayd.mqtt.wire import MAXIMUM_PACKET_SIZE, SESSION_EXPIRY, binary, packet, text, varint

PINGREQ: Final = b"\xc0\x00"
DISCONNECT: Final = b"\xe0\x00"
"""A normal one: the broker forgets the will (3.1.1, 3.14; 5.0, 3.14)."""
_CLEAN, _WILL, _WILL_RETAIN, _PASSWORD, _USER = 0x02, 0x04, 0x20, 0x40, 0x80
_AS_PUBLISHED: Final = 0x08
"""Option of a subscription (5.0, 3.8.3.1): a message keeps the mark that its publisher wanted it retained."""


def connect(settings: BrokerSettings, password: str | None, will: Message | None) -> bytes:
    """CONNECT: a clean session that ends with the connection, so that nothing is ever kept for us."""
    is_5 = settings.version == MQTT_5
    flags = _CLEAN
    body = b""
    if is_5:
        limits = bytes((SESSION_EXPIRY, 0, 0, 0, 0, MAXIMUM_PACKET_SIZE)) + MAX_PACKET.to_bytes(4, "big")
        body += varint(len(limits)) + limits
    body += text(settings.client)
    if will is not None:
        flags |= _WILL | will.qos << 3 | (_WILL_RETAIN if will.retain else 0)
        body += (b"\0" if is_5 else b"") + text(will.topic) + binary(will.payload)
    if settings.username:
        flags |= _USER
        body += text(settings.username)
        if password is not None:
            flags |= _PASSWORD
            body += binary(password.encode())
    head = text("MQTT") + bytes((settings.version, flags)) + settings.keepalive.to_bytes(2, "big")
    return packet(0x10, head + body)


def publish(version: int, message: Message, number: int) -> bytes:
    """PUBLISH; `number` identifies it where its QoS is 1. Raises ValueError for a topic that cannot be."""
    if not message.topic or any(each in message.topic for each in WILDCARDS):
        raise ValueError(f"no topic to publish to: {message.topic!r}")
    identifier = number.to_bytes(2, "big") if message.qos else b""
    properties = b"\0" if version == MQTT_5 else b""
    body = text(message.topic) + identifier + properties + message.payload
    return packet(0x30 | message.qos << 1 | message.retain, body)


def puback(number: int) -> bytes:
    """PUBACK: a message of QoS 1 was taken."""
    return packet(0x40, number.to_bytes(2, "big"))


def subscribe(version: int, topics: Sequence[str], qos: int, number: int) -> bytes:
    """SUBSCRIBE."""
    options = bytes((qos | (_AS_PUBLISHED if version == MQTT_5 else 0),))
    return packet(0x82, _head(version, number) + b"".join(text(topic) + options for topic in topics))


def unsubscribe(version: int, topics: Sequence[str], number: int) -> bytes:
    """UNSUBSCRIBE."""
    return packet(0xA2, _head(version, number) + b"".join(map(text, topics)))


def _head(version: int, number: int) -> bytes:
    return number.to_bytes(2, "big") + (b"\0" if version == MQTT_5 else b"")
