"""Bytes of a connection to MQTT packets, bounded (MQTT 3.1.1 and 5.0, section 2).

A broker may pass on 256 MB in one message. Of a PUBLISH beyond the bound only the beginning is kept, for the report;
the rest is let pass as it comes: it costs neither memory nor the connection. Any other packet of that size is no MQTT.
"""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.mqtt.messages import MAX_PACKET
from gatewayd.mqtt.wire import MqttProtocolError

PUBLISH = 3
_MAX_LENGTH_BYTES = 4
_KEPT = 512
"""Bytes of an oversized message that are kept."""


@dataclass(frozen=True, slots=True)
class Oversized:
    """A message that was let pass unread."""

    topic: str
    length: int


@dataclass(slots=True)
class _Passing:
    """An oversized message on its way."""

    length: int
    left: int
    kept: bytes = b""


class PacketSplitter:
    """Takes bytes as they come and gives whole packets."""

    def __init__(self, limit: int = MAX_PACKET) -> None:
        self._limit = limit
        self._buffer = bytearray()
        self._passing: _Passing | None = None

    def feed(self, data: bytes) -> list[bytes | Oversized]:
        """The packets that are complete now. Raises MqttProtocolError."""
        found: list[bytes | Oversized] = []
        self._buffer += data
        while self._buffer:
            taken = self._pass() if self._passing is not None else self._take()
            if taken is None:
                break
            if taken:
                found.append(taken)
        return found

    def _take(self) -> bytes | Oversized | None:
        """One packet; None: it is not complete; empty: an oversized one has begun."""
        head = _head(self._buffer)
        if head is None:
            return None
        start, length = head
        if start + length > self._limit:
            if self._buffer[0] >> 4 != PUBLISH:
                raise MqttProtocolError(f"a packet of {length} bytes that is no message")
            self._passing = _Passing(length, length)
            del self._buffer[:start]
            return b""
        if len(self._buffer) < start + length:
            return None
        packet = bytes(self._buffer[: start + length])
        del self._buffer[: start + length]
        return packet

    def _pass(self) -> Oversized | bytes | None:
        passing = self._passing
        assert passing is not None
        here = min(passing.left, len(self._buffer))
        if len(passing.kept) < _KEPT:
            passing.kept += bytes(self._buffer[: min(here, _KEPT - len(passing.kept))])
        del self._buffer[:here]
        passing.left -= here
        if passing.left:
            return None
        self._passing = None
        return Oversized(_topic(passing.kept), passing.length)


def _head(buffer: bytearray) -> tuple[int, int] | None:
    """Where the packet goes on behind its length, and the length (3.1.1, 2.2.3); None: not all of it is there."""
    length = 0
    for index in range(_MAX_LENGTH_BYTES):
        if index + 1 >= len(buffer):
            return None
        byte = buffer[index + 1]
        length |= (byte & 0x7F) << (7 * index)
        if not byte & 0x80:
            return index + 2, length
    raise MqttProtocolError("a length of more than four bytes")


def _topic(kept: bytes) -> str:
    size = int.from_bytes(kept[:2], "big")
    return kept[2 : 2 + size].decode("utf-8", "replace")
