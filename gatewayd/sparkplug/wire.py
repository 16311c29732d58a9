"""The encoding of Protocol Buffers, as far as the schema of Sparkplug B needs it (protobuf.dev, "Encoding").

Reading never trusts a length, and whatever is wrong is a `PayloadError`. Fields that nobody knows are skipped, groups
included.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

VARINT, FIXED64, BYTES, GROUP, GROUP_END, FIXED32 = range(6)
"""Wire types."""
MAX_UINT32 = 0xFFFF_FFFF
MAX_UINT64 = 0xFFFF_FFFF_FFFF_FFFF
_MAX_VARINT = 10
"""Bytes of the longest varint, a negative number."""
_MAX_GROUPS = 32
"""Groups in each other that are skipped."""

_FLOAT, _DOUBLE = struct.Struct("<f"), struct.Struct("<d")

Content = int | bytes
"""Of a field: a number for VARINT, else its bytes."""


class PayloadError(ValueError):
    """A payload, or a part of it, is not what the specification says. Its text says what is wrong."""


def read_fields(data: bytes) -> Iterator[tuple[int, int, Content]]:
    """Number, wire type and content of each field of a message, in its order."""
    position, end = 0, len(data)
    while position < end:
        key, position = _read_varint(data, position)
        number, wire_type = _split(key)
        if wire_type == GROUP:
            position = _after_group(data, position, number)
            continue
        content, position = _read_content(data, position, wire_type)
        yield number, wire_type, content


def _split(key: int) -> tuple[int, int]:
    if not 8 <= key <= MAX_UINT32:
        raise PayloadError(f"has a field with the number {key >> 3}")
    return key >> 3, key & 7


def _read_content(data: bytes, position: int, wire_type: int) -> tuple[Content, int]:
    if wire_type == VARINT:
        return _read_varint(data, position)
    if wire_type == BYTES:
        size, position = _read_varint(data, position)
    elif wire_type == FIXED64:
        size = 8
    elif wire_type == FIXED32:
        size = 4
    else:
        raise PayloadError(f"has wire type {wire_type} where a field begins")
    after = position + size
    if after > len(data):
        raise PayloadError(f"ends too early; missing bytes: {after - len(data)}")
    return data[position:after], after


def _read_varint(data: bytes, position: int) -> tuple[int, int]:
    value = shift = 0
    for byte in data[position : position + _MAX_VARINT]:
        position += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & MAX_UINT64, position
        shift += 7
    raise PayloadError(
        "ends in the middle of a number" if position >= len(data) else "has a number of over 10 bytes"
    )


def _after_group(data: bytes, position: int, number: int) -> int:
    """Where a group that has begun is over. No field of the schema is a group, so it is skipped."""
    opened = [number]
    while opened:
        key, position = _read_varint(data, position)
        inner, wire_type = _split(key)
        if wire_type == GROUP:
            opened.append(inner)
            if len(opened) > _MAX_GROUPS:
                raise PayloadError(f"has over {_MAX_GROUPS} groups in each other")
        elif wire_type == GROUP_END:
            if opened.pop() != inner:
                raise PayloadError(f"ends a group {inner} that has not begun")
        else:
            _, position = _read_content(data, position, wire_type)
    return position


def text_of(content: bytes) -> str:
    """A string field."""
    try:
        return content.decode()
    except UnicodeDecodeError:
        raise PayloadError(f"has a text that is not UTF-8: {content[:32]!r}") from None


def float_of(content: bytes) -> float:
    """The content of a FIXED32 field as a float."""
    number: float = _FLOAT.unpack(content)[0]
    return number


def double_of(content: bytes) -> float:
    """The content of a FIXED64 field as a double."""
    number: float = _DOUBLE.unpack(content)[0]
    return number


def varint(value: int) -> bytes:
    """A number from 0 to 2^64 - 1."""
    if value < 0x80:
        return bytes((value,))
    encoded = bytearray()
    while value >= 0x80:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def varint_field(number: int, value: int) -> bytes:
    """A field with a number or a truth value."""
    return varint(number << 3) + varint(value)


def bytes_field(number: int, content: bytes) -> bytes:
    """A field with bytes, or with a message."""
    return varint(number << 3 | BYTES) + varint(len(content)) + content


def text_field(number: int, text: str) -> bytes:
    """A field with a string."""
    return bytes_field(number, text.encode())


def float_field(number: int, value: float) -> bytes:
    """A field with a float."""
    return varint(number << 3 | FIXED32) + _FLOAT.pack(value)


def double_field(number: int, value: float) -> bytes:
    """A field with a double."""
    return varint(number << 3 | FIXED64) + _DOUBLE.pack(value)
