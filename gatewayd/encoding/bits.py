"""Truths that are packed eight to a byte, the first one in the least significant bit."""

from __future__ import annotations

from itertools import chain
from typing import Final

BITS_OF: Final = tuple(tuple(bool(byte >> bit & 1) for bit in range(8)) for byte in range(256))
"""The bits of every byte."""


def unpacked(data: bytes, count: int) -> tuple[bool, ...]:
    """The first `count` bits."""
    return tuple(chain.from_iterable(map(BITS_OF.__getitem__, data)))[:count]
