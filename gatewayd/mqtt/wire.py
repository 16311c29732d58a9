"""Numbers, texts and properties as MQTT encodes them (3.1.1, 1.5 and 2.2.3; 5.0, 1.5 and 2.2.2). Pure."""

from __future__ import annotations

from typing import Final

MAX_TEXT: Final = 65_535
"""Bytes of a text or of binary data: their length has two bytes."""

_NUMBER_SIZES: Final = {
    1: 1, 2: 4, 17: 4, 19: 2, 23: 1, 24: 4, 25: 1, 33: 2, 34: 2, 35: 2, 36: 1, 37: 1, 39: 4, 40: 1, 41: 1, 42: 1,
}  # fmt: skip
"""Property -> bytes of its number (5.0, 2.2.2.2)."""
_TEXTS: Final = frozenset({3, 8, 9, 18, 21, 22, 26, 28, 31})
"""Properties that are a text or binary data."""
_USER_PROPERTY, _SUBSCRIPTION = 38, 11
PROPERTIES: Final = frozenset({*_NUMBER_SIZES, *_TEXTS, _USER_PROPERTY, _SUBSCRIPTION})
SESSION_EXPIRY: Final = 17
SERVER_KEEPALIVE: Final = 19
MAXIMUM_PACKET_SIZE: Final = 39


class MqttProtocolError(ValueError):
    """The bytes are not MQTT; the connection cannot go on."""


class ShortPacketError(MqttProtocolError):
    """The packet ends before what it should have."""

    def __init__(self) -> None:
        super().__init__("a packet that ends too early")


def varint(value: int) -> bytes:
    """A length: seven bits a byte, the lowest first."""
    found = bytearray()
    while value > 0x7F:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    found.append(value)
    return bytes(found)


def binary(data: bytes) -> bytes:
    """Data with its length. Raises ValueError where it is too long for one."""
    if len(data) > MAX_TEXT:
        raise ValueError(f"{len(data)} bytes are more than MQTT has room for")
    return len(data).to_bytes(2, "big") + data


def text(value: str) -> bytes:
    """A text with its length. Raises ValueError for one that MQTT forbids (5.0, 1.5.4)."""
    if "\0" in value:
        raise ValueError("a text with a character that MQTT forbids: U+0000")
    return binary(value.encode())


def packet(first: int, body: bytes) -> bytes:
    """A packet with its length behind its first byte."""
    return bytes((first,)) + varint(len(body)) + body


class PacketReader:
    """Takes one field after the other. Raises MqttProtocolError."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    @classmethod
    def of(cls, whole: bytes) -> PacketReader:
        """The content of a whole packet, behind its length."""
        start = 1
        while start < len(whole) - 1 and whole[start] & 0x80:
            start += 1
        return cls(whole[start + 1 :])

    @property
    def left(self) -> int:
        """Bytes that are not taken yet."""
        return len(self.data) - self.at

    def take(self, size: int) -> bytes:
        """So many bytes."""
        if size > self.left:
            raise ShortPacketError
        self.at += size
        return self.data[self.at - size : self.at]

    def number(self, size: int) -> int:
        """A number of so many bytes."""
        return int.from_bytes(self.take(size), "big")

    def binary(self) -> bytes:
        """Data with its length."""
        return self.take(self.number(2))

    def text(self) -> str:
        """A text with its length."""
        try:
            found = self.binary().decode()
        except UnicodeDecodeError:
            raise MqttProtocolError("a text that is not UTF-8") from None
        if "\0" in found:
            raise MqttProtocolError("a text with U+0000")
        return found

    def varint(self) -> int:
        """A length."""
        value = 0
        for shift in range(0, 28, 7):
            byte = self.number(1)
            value |= (byte & 0x7F) << shift
            if not byte & 0x80:
                return value
        raise MqttProtocolError("a length of more than four bytes")

    def rest(self) -> bytes:
        """All that is left, which stays."""
        return self.data[self.at :]

    def properties(self) -> dict[int, int]:
        """Those that are numbers; all others are passed."""
        inner = PacketReader(self.take(self.varint()))
        found: dict[int, int] = {}
        while inner.left:
            known = inner.varint()
            if known in _NUMBER_SIZES:
                if known in found:
                    raise MqttProtocolError(f"property {known} stands there twice")
                found[known] = inner.number(_NUMBER_SIZES[known])
            elif known in _TEXTS:
                inner.binary()
            elif known == _USER_PROPERTY:
                inner.binary()
                inner.binary()
            elif known == _SUBSCRIPTION:
                inner.varint()
            else:
                raise MqttProtocolError(f"property {known}, which does not exist")
        return found
