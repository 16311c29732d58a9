"""The bytes of SDO frames: what a client's command byte asks for, and the server's answers (CiA 301, 7.2.4.3)."""

from __future__ import annotations

import struct
from enum import Enum, auto

from gatewayd.canopen.dictionary import AbortCode

SEGMENT = 7
"""Bytes of data in a segment."""


class Request(Enum):
    """What a client's frame asks for."""

    DOWNLOAD = auto()
    DOWNLOAD_SEGMENT = auto()
    UPLOAD = auto()
    UPLOAD_SEGMENT = auto()
    BLOCK_DOWNLOAD = auto()
    BLOCK_SEGMENT = auto()
    BLOCK_DOWNLOAD_END = auto()
    BLOCK_UPLOAD = auto()
    BLOCK_UPLOAD_START = auto()
    BLOCK_UPLOAD_ACKNOWLEDGE = auto()
    BLOCK_UPLOAD_END = auto()
    ABORT = auto()
    UNKNOWN = auto()


_BLOCK_UPLOAD = (
    Request.BLOCK_UPLOAD,
    Request.BLOCK_UPLOAD_END,
    Request.BLOCK_UPLOAD_ACKNOWLEDGE,
    Request.BLOCK_UPLOAD_START,
)
_SPECIFIERS = (
    (Request.DOWNLOAD_SEGMENT,),
    (Request.DOWNLOAD,),
    (Request.UPLOAD,),
    (Request.UPLOAD_SEGMENT,),
    (Request.ABORT,),
    _BLOCK_UPLOAD,
    (Request.BLOCK_DOWNLOAD, Request.BLOCK_DOWNLOAD_END),
    (Request.UNKNOWN,),
)
"""By the client command specifier (bits 7-5), then by the subcommand in the lowest bits, where there is one."""

REQUESTS = tuple(kinds[low % len(kinds)] for kinds in _SPECIFIERS for low in range(32))
"""What a command byte means."""
BLOCK_SEGMENTS = tuple(Request.ABORT if command == 0x80 else Request.BLOCK_SEGMENT for command in range(256))
"""What it means while the segments of a block download come: a sequence number, for all but an abort."""

_PADDING = tuple(bytes(count) for count in range(8))
_SIZE = struct.Struct("<I")
_CRC = struct.Struct("<BH5x")

BLOCK_DOWNLOAD_ENDED = b"\xa1" + _PADDING[7]
"""The data was taken whole."""


def abort(multiplexer: bytes, code: AbortCode) -> bytes:
    """The transfer of an object (the three bytes of its index and sub-index) has ended with `code`."""
    return b"\x80" + multiplexer + _SIZE.pack(code)


def download_initiated(multiplexer: bytes) -> bytes:
    """An expedited download was done, or segments may come."""
    return b"\x60" + multiplexer + _PADDING[4]


def download_segment_taken(toggle: int) -> bytes:
    """The segment with this toggle bit (0 or 0x10) was taken."""
    return bytes((0x20 | toggle,)) + _PADDING[7]


def upload_initiated(multiplexer: bytes, data: bytes) -> bytes:
    """One to four bytes at once, or the size of what follows in segments."""
    if is_expedited(data):
        unused = 4 - len(data)
        return bytes((0x43 | unused << 2,)) + multiplexer + data + _PADDING[unused]
    return b"\x41" + multiplexer + _SIZE.pack(len(data))


def is_expedited(data: bytes) -> bool:
    """Whether an upload of `data` takes one frame."""
    return 1 <= len(data) <= 4


def upload_segment(toggle: int, data: bytes, *, last: bool) -> bytes:
    """Up to seven bytes of an upload."""
    unused = SEGMENT - len(data)
    return bytes((toggle | unused << 1 | last,)) + data + _PADDING[unused]


def block_download_initiated(multiplexer: bytes, segments: int, *, checked: bool) -> bytes:
    """Segments may come, `segments` to a sub-block; `checked`: the CRC will be."""
    return bytes((0xA4 if checked else 0xA0,)) + multiplexer + bytes((segments, 0, 0, 0))


def block_download_acknowledged(taken: int, segments: int) -> bytes:
    """So many segments of the sub-block were taken; the next sub-block may have `segments`."""
    return bytes((0xA2, taken, segments)) + _PADDING[5]


def block_upload_initiated(multiplexer: bytes, size: int, *, checked: bool) -> bytes:
    """So many bytes will come; `checked`: with a CRC.

    There are clients that take the server's word alone for it, so it is given only to those that asked for a CRC.
    """
    return bytes((0xC6 if checked else 0xC2,)) + multiplexer + _SIZE.pack(size)


def block_upload_ended(unused: int, crc: int) -> bytes:
    """All came; `unused` bytes of the last segment are no data."""
    return _CRC.pack(0xC1 | unused << 2, crc)


class SdoAnswer(Enum):
    """What a server's frame says."""

    UPLOAD_SEGMENT = auto()
    DOWNLOAD_SEGMENT = auto()
    UPLOAD = auto()
    DOWNLOAD = auto()
    ABORT = auto()
    BLOCK = auto()
    UNKNOWN = auto()


_ANSWERS = (
    SdoAnswer.UPLOAD_SEGMENT,
    SdoAnswer.DOWNLOAD_SEGMENT,
    SdoAnswer.UPLOAD,
    SdoAnswer.DOWNLOAD,
    SdoAnswer.ABORT,
    SdoAnswer.BLOCK,
    SdoAnswer.BLOCK,
    SdoAnswer.UNKNOWN,
)
"""By the server command specifier (bits 7-5)."""
ANSWERS = tuple(_ANSWERS[command >> 5] for command in range(256))
"""What a command byte of a server means."""


def download_request(multiplexer: bytes, data: bytes) -> bytes:
    """One to four bytes at once, or the size of what follows in segments."""
    if is_expedited(data):
        unused = 4 - len(data)
        return bytes((0x23 | unused << 2,)) + multiplexer + data + _PADDING[unused]
    return b"\x21" + multiplexer + _SIZE.pack(len(data))


def upload_request(multiplexer: bytes) -> bytes:
    """The value of an object is asked for."""
    return b"\x40" + multiplexer + _PADDING[4]


def upload_segment_request(toggle: int) -> bytes:
    """The segment with this toggle bit (0 or 0x10) is asked for."""
    return bytes((0x60 | toggle,)) + _PADDING[7]


def uploaded(data: bytes) -> bytes | None:
    """The value in an answer that has it at once; None if it comes in segments.

    All four bytes where the server does not say how many of them count.
    """
    command = data[0]
    if not command & 0x02:
        return None
    return data[4 : 8 - (command >> 2 & 3) if command & 0x01 else 8]


def announced_size(data: bytes) -> int | None:
    """The bytes that will come in segments, if the answer says so."""
    size: int = _SIZE.unpack_from(data, 4)[0]
    return size if data[0] & 0x01 else None


def abort_code(data: bytes) -> int:
    """Why a transfer has ended."""
    code: int = _SIZE.unpack_from(data, 4)[0]
    return code
