"""The line of a package in a recording of text, compiled for its recipe."""

from __future__ import annotations

import struct

from gatewayd.rtde.recipe import Recipe

_TOGETHER = 24
"""Columns that are written anew together: less, and looking for changes takes the time that it saves."""


class RowText:
    """Turns payloads into lines without their end.

    Most of what a robot reports stays as it is from package to package: whatever has the same bytes as in the package
    before keeps its text. Bytes, because 0.0 and -0.0 are equal as numbers, and a text of their own each.
    """

    __slots__ = ("_delimiter", "_last", "_parts", "_texts", "_unpack")

    def __init__(self, recipe: Recipe, delimiter: str) -> None:
        # A boolean is unpacked as a number: that is its text.
        codes = "".join(kind.format for kind in recipe.types).replace("?", "B")
        self._unpack = struct.Struct(">" + codes).unpack
        self._delimiter = delimiter
        self._parts: list[tuple[int, slice, slice]] = []
        """Number, place in the payload and place in the values of the columns that are written together."""
        begin = 0
        for number, first in enumerate(range(0, len(codes), _TOGETHER)):
            part = codes[first : first + _TOGETHER]
            end = begin + struct.calcsize(">" + part)
            self._parts.append((number, slice(begin, end), slice(first, first + len(part))))
            begin = end
        self._last = [b""] * len(self._parts)
        self._texts = [""] * len(self._parts)

    def line(self, payload: bytes) -> str:
        """The line of a payload, which has the recipe's length."""
        last, texts, values = self._last, self._texts, None
        for number, place, slots in self._parts:
            part = payload[place]
            if part != last[number]:
                if values is None:
                    values = self._unpack(payload)
                last[number] = part
                texts[number] = self._delimiter.join(map(repr, values[slots]))
        return self._delimiter.join(texts)
