"""The layout of a data package: an ordered list of fields with their types, compiled once (guide, "Data types")."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from gatewayd.report.format import counted
from gatewayd.rtde.codec import ProtocolError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from gatewayd.rtde.types import DataType

Scalar = bool | int | float
"""One element of a value: bool for BOOL, int for the integer types, float for DOUBLE and its vectors."""


class Recipe:
    """Field names and types of one recipe, and the struct they make.

    Values travel as one flat tuple in which a vector takes as many places as it has elements.
    """

    __slots__ = ("_struct", "count", "kinds", "names", "size", "slots", "types", "unpack_from")

    def __init__(self, names: Sequence[str], types: Sequence[DataType]) -> None:
        if len(names) != len(types):
            msg = f"{counted(len(names), 'name')} but {counted(len(types), 'type')}"
            raise ValueError(msg)
        self.names = tuple(names)
        self.types = tuple(types)
        self.kinds = dict(zip(names, types, strict=True))
        """The type of each field."""
        self._struct = struct.Struct(">" + "".join(data_type.format for data_type in types))
        self.unpack_from: Callable[[bytes | memoryview, int], tuple[Scalar, ...]] = self._struct.unpack_from
        """The flat values of a payload that lies at this place of a buffer, which has to have all of it."""
        self.size = self._struct.size
        """Bytes of a payload, without the recipe id."""
        self.slots: dict[str, slice] = {}
        """Where the elements of each field lie in the flat tuple."""
        place = 0
        for name, data_type in zip(self.names, self.types, strict=True):
            self.slots[name] = slice(place, place + data_type.count)
            place += data_type.count
        self.count = place
        """Places of the flat tuple."""

    def __repr__(self) -> str:
        fields = ", ".join(f"{name}: {kind.word}" for name, kind in self.kinds.items())
        return f"Recipe({fields})"

    def unpack(self, payload: bytes) -> tuple[Scalar, ...]:
        """The flat values of a payload; ProtocolError if it has not the recipe's length."""
        try:
            return self._struct.unpack(payload)
        except struct.error:
            reason = (
                f"data package with {counted(len(payload), 'byte')} of values, the recipe has {self.size}"
            )
            raise ProtocolError(reason, min(len(payload), self.size), payload, within="payload") from None

    def pack(self, values: Sequence[Scalar]) -> bytes:
        """The payload of flat values; ValueError names the first value that its type cannot hold."""
        try:
            return self._struct.pack(*values)
        except (struct.error, OverflowError) as error:
            raise ValueError(self._complaint(values)) from error

    def _complaint(self, values: Sequence[Scalar]) -> str:
        if len(values) != self.count:
            return f"{counted(len(values), 'value')} for a recipe of {self.count}"
        for name, kind in self.kinds.items():
            for value in values[self.slots[name]]:
                try:
                    struct.pack(">" + kind.code, value)
                except (struct.error, OverflowError):
                    return f"{name} is {kind.word} and cannot hold {value!r}"
        return "values that do not fit the recipe"
