"""Questions to the kernel over rtnetlink, and its answers: what those about interfaces and routes have in common.

Reading needs no privilege. Structures and numbers are those of linux/netlink.h, in the byte order of this machine.
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from typing import NamedTuple

MAX_REPLY = 32768
"""Bytes of the longest answer that is read."""

_HEADER = struct.Struct("=IHHII")
_ATTRIBUTE = struct.Struct("=HH")
_ERROR = struct.Struct("=i")
_WORD = struct.Struct("=I")
_NLMSG_ERROR, _NLM_F_REQUEST = 2, 1
_TYPE_MASK = 0x3FFF
"""Without the bits that say how an attribute is nested and ordered."""


class Answer(NamedTuple):
    """An answer of the kernel."""

    sequence: int
    """Of the question."""
    error: int
    """Number of the error with which the kernel refuses; 0: it does not."""
    body: bytes
    """What follows the header."""


def open_socket() -> socket.socket:
    """A socket to the kernel. It does not block: the kernel has answered before `sendto` returns."""
    kernel = socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE)
    kernel.setblocking(False)
    return kernel


def question(kind: int, body: bytes, sequence: int) -> bytes:
    """A message that the kernel answers."""
    return _HEADER.pack(_HEADER.size + len(body), kind, _NLM_F_REQUEST, sequence, 0) + body


def answer(message: bytes) -> Answer:
    """The kernel's message in parts; struct.error if it is too short for them."""
    _, kind, _, sequence, _ = _HEADER.unpack_from(message)
    error = -_ERROR.unpack_from(message, _HEADER.size)[0] if kind == _NLMSG_ERROR else 0
    return Answer(sequence, error, message[_HEADER.size :])


def attribute(kind: int, data: bytes) -> bytes:
    """An attribute of a question, filled up to whole words."""
    return _ATTRIBUTE.pack(_ATTRIBUTE.size + len(data), kind) + data + bytes(-len(data) % 4)


def attributes(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Kinds and contents of attributes, up to the first that cannot be one."""
    place = 0
    while place + _ATTRIBUTE.size <= len(data):
        length, kind = _ATTRIBUTE.unpack_from(data, place)
        if length < _ATTRIBUTE.size:
            return
        yield kind & _TYPE_MASK, data[place + _ATTRIBUTE.size : place + length]
        place += (length + 3) & ~3


def word(data: bytes | None) -> int | None:
    """The number of 32 bits with which an attribute begins; None: it is missing, or too short."""
    return int(_WORD.unpack_from(data)[0]) if data and len(data) >= _WORD.size else None
