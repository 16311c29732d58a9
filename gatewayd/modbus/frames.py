"""The MBAP frame around a Modbus PDU (Messaging on TCP/IP Guide V1.0b, 3.1.3), without any input or output.

A frame is transaction id, protocol id (0), length (unit id and PDU, 2..254), unit id, PDU; all numbers big-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

HEADER_SIZE = 7
"""Bytes before the PDU."""
UNIT = 6
"""Position of the unit id."""
MAX_PDU = 253
"""Bytes (Application Protocol V1.1b3, 4.1)."""
MAX_FRAME = HEADER_SIZE + MAX_PDU
BUFFER_SIZE = 1024
"""Bytes taken from a connection at a time; bounds what one peer can make us do before the next has its turn."""

_MIN_LENGTH = 2
_MAX_LENGTH = MAX_PDU + 1
_PREFIX = 6
"""Bytes up to and with the length, which does not count them."""
_HEADER = struct.Struct(">HHHB")


class FramingError(ValueError):
    """Bytes that are no Modbus frame. Where the next one begins cannot be known: the connection must be closed."""


class ModbusFrame(NamedTuple):
    """One request as it came in."""

    transaction: int
    unit: int
    pdu: bytes
    end: int
    """Position behind the frame."""


def encode(transaction: int, unit: int, pdu: bytes) -> bytes:
    """The frame of an answer; transaction and unit are the request's own."""
    return _HEADER.pack(transaction, 0, len(pdu) + 1, unit) + pdu


def split(data: bytearray, start: int, end: int) -> ModbusFrame | None:
    """The frame that begins at `start`, or None if it is not complete at `end`.

    Raises FramingError as soon as the protocol id or the length is known to be wrong.
    """
    if end - start < _PREFIX:
        return None
    protocol = data[start + 2] << 8 | data[start + 3]
    length = data[start + 4] << 8 | data[start + 5]
    if protocol:
        raise FramingError(f"protocol id {protocol} instead of 0")
    if not _MIN_LENGTH <= length <= _MAX_LENGTH:
        raise FramingError(f"length {length} is not within {_MIN_LENGTH}..{_MAX_LENGTH}")
    behind = start + _PREFIX + length
    if behind > end:
        return None
    return ModbusFrame(
        data[start] << 8 | data[start + 1], data[start + 6], bytes(data[start + HEADER_SIZE : behind]), behind
    )


def whole_frames(data: bytes) -> Iterator[bytes]:
    """Each complete frame of a stream, with its header. Bytes that are no frame come as they are."""
    stream, start = bytearray(data), 0
    try:
        while (frame := split(stream, start, len(stream))) is not None:
            yield data[start : frame.end]
            start = frame.end
    except FramingError:
        yield data[start:]


class FrameBuffer:
    """What has come in on one connection and is not answered yet. Its size never changes."""

    __slots__ = ("_view", "data", "end", "space")

    def __init__(self, size: int = BUFFER_SIZE) -> None:
        self.data = bytearray(max(size, 2 * MAX_FRAME))
        self.end = 0
        """Position behind the last byte that came in."""
        self._view = memoryview(self.data)
        self.space = (self._view,)
        """Where the next bytes are to be written, as `os.readv` takes it; never empty after `discard`."""

    def discard(self, start: int, end: int) -> None:
        """What has come in reaches to `end`; forget what lies before `start`. The rest moves to the front.

        Without `start` the rest must be less than a frame.
        """
        rest = end - start
        if rest:
            self.data[:rest] = self.data[start:end]
        if rest != self.end:
            self.end = rest
            self.space = (self._view[rest:],)
