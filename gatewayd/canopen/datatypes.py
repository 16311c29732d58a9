"""The CiA 301 data types that this node uses: codes, lengths, and values to little-endian bytes and back (7.1)."""

from __future__ import annotations

import struct
from enum import Enum

Value = bool | int | float
"""What a numeric type holds."""


class CanType(Enum):
    """A static or string data type: its index in the dictionary (7.4.7), `struct` format and length in bits."""

    BOOLEAN = (0x01, "?", 1)
    INTEGER8 = (0x02, "b", 8)
    INTEGER16 = (0x03, "h", 16)
    INTEGER32 = (0x04, "i", 32)
    UNSIGNED8 = (0x05, "B", 8)
    UNSIGNED16 = (0x06, "H", 16)
    UNSIGNED32 = (0x07, "I", 32)
    REAL32 = (0x08, "f", 32)
    VISIBLE_STRING = (0x09, "", 0)
    DOMAIN = (0x0F, "", 0)
    REAL64 = (0x11, "d", 64)
    INTEGER64 = (0x15, "q", 64)
    UNSIGNED64 = (0x1B, "Q", 64)

    def __init__(self, code: int, char: str, bits: int) -> None:
        self.code = code
        """Index of the type in the object dictionary."""
        self.char = char
        """`struct` format character; empty for strings and domains."""
        self.bits = bits
        """Length in a PDO; 0 for strings and domains, which no PDO carries."""
        self._struct = struct.Struct("<" + char)

    @property
    def size(self) -> int | None:
        """Bytes of an SDO transfer; None where any length goes."""
        return self._struct.size if self.char else None

    @property
    def is_real(self) -> bool:
        """Whether values are floating-point numbers."""
        return self in (CanType.REAL32, CanType.REAL64)

    @property
    def bounds(self) -> tuple[int, int]:
        """Smallest and largest number of an integer type."""
        signed = self.char.islower()
        return -(1 << self.bits - 1) if signed else 0, (1 << self.bits - signed) - 1

    def pack(self, value: Value) -> bytes:
        """Little-endian bytes of a number. OverflowError or struct.error if the type cannot hold it."""
        return self._struct.pack(value)

    def unpack(self, data: bytes) -> Value:
        """The number in little-endian bytes of exactly `size`."""
        value: Value = self._struct.unpack(data)[0]
        return value
