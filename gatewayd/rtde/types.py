"""The data types of RTDE and how their values lie in a package (guide, section "Data types"): big-endian, packed."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from enum import Enum

DEFAULT_PORT = 30004
"""TCP port of the RTDE interface."""

INTEGER_RANGES: Mapping[str, tuple[int, int]] = {
    "B": (0, 0xFF),
    "I": (0, 0xFFFF_FFFF),
    "Q": (0, 0xFFFF_FFFF_FFFF_FFFF),
    "i": (-0x8000_0000, 0x7FFF_FFFF),
}
"""Smallest and largest element of the integer types, by `DataType.code`."""


class DataType(Enum):
    """A type word as the controller spells it; `code` and `count` are its `struct` format and number of elements."""

    BOOL = ("BOOL", "?", 1)
    UINT8 = ("UINT8", "B", 1)
    UINT32 = ("UINT32", "I", 1)
    UINT64 = ("UINT64", "Q", 1)
    INT32 = ("INT32", "i", 1)
    DOUBLE = ("DOUBLE", "d", 1)
    VECTOR3D = ("VECTOR3D", "d", 3)
    VECTOR6D = ("VECTOR6D", "d", 6)
    VECTOR6INT32 = ("VECTOR6INT32", "i", 6)
    VECTOR6UINT32 = ("VECTOR6UINT32", "I", 6)

    def __init__(self, word: str, code: str, count: int) -> None:
        self.word = word
        """Spelling on the wire."""
        self.code = code
        """`struct` format character of one element."""
        self.count = count
        """Number of elements: 1, or the length of the vector."""
        self.bits = 8 * struct.calcsize(">" + code) if code in INTEGER_RANGES else None
        """Bits of one element of an integer type; None for the others."""

    @property
    def format(self) -> str:
        """`struct` format of the whole value, without byte order."""
        return self.code * self.count

    @property
    def element(self) -> DataType:
        """The type of one element."""
        return next(kind for kind in DataType if kind.code == self.code)

    @property
    def is_vector(self) -> bool:
        """Whether a value consists of several elements."""
        return self.count > 1

    @classmethod
    def from_word(cls, word: str) -> DataType:
        """The type spelled `word`; KeyError for anything else, the error words included."""
        return cls[word]
