"""The content of a PDO that a device has laid out: bytes to raw numbers and back, compiled once.

Devices lay their PDOs out as they like: numbers of 24 bits, and numbers off a byte boundary. So a PDO is one integer
here, and each object a shift and a mask of it, least significant bit of the first byte first (CiA 301, 7.3.2). What a
node of this gateway serves follows narrower rules of its own, and goes through one `struct`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence

from gatewayd.canopen.datatypes import CanType, Value
from gatewayd.canopen.manager.plan import MAX_PDO_BITS, PdoObject

_Decode = Callable[[int], Value]
_Encode = Callable[[Value], int]


class PdoContent:
    """The objects of one PDO as numbers in their order."""

    def __init__(self, objects: Iterable[PdoObject]) -> None:
        """ValueError for more than 64 bits, and for an object without any."""
        places: list[tuple[int, int, _Decode, _Encode]] = []
        shift = 0
        for item in objects:
            if item.bits < 1:
                raise ValueError(f"{item.index:04X}h:{item.subindex:02X} has no bits in a PDO")
            places.append((shift, (1 << item.bits) - 1, _decoder(item), _encoder(item)))
            shift += item.bits
        if shift > MAX_PDO_BITS:
            raise ValueError(f"{shift} bits do not fit into a PDO")
        self.size = (shift + 7) // 8
        """Bytes."""
        self._decoders = tuple((shift, mask, decode) for shift, mask, decode, _ in places)
        self._encoders = tuple((shift, mask, encode) for shift, mask, _, encode in places)

    def unpack(self, data: bytes) -> list[Value]:
        """The numbers in at least `size` bytes."""
        whole = int.from_bytes(data, "little")
        return [decode(whole >> shift & mask) for shift, mask, decode in self._decoders]

    def pack(self, values: Sequence[Value]) -> bytes:
        """The bytes of numbers that their types can hold; what is too wide loses its highest bits."""
        whole = 0
        for value, (shift, mask, encode) in zip(values, self._encoders, strict=True):
            whole |= (encode(value) & mask) << shift
        return whole.to_bytes(self.size, "little")


_REALS = {CanType.REAL32: ("<f", "<I"), CanType.REAL64: ("<d", "<Q")}


def _decoder(item: PdoObject) -> _Decode:
    """Where a device gives an object other bits than its type has, these count: old drives map BOOLEANs as bytes."""
    kind = item.type
    if kind is CanType.BOOLEAN:
        return bool
    if _is_real(item) and kind is not None:
        real, whole = (struct.Struct(form) for form in _REALS[kind])
        return lambda bits: float(real.unpack(whole.pack(bits))[0])
    if kind is None or kind.is_real or not kind.char.islower():
        return lambda bits: bits
    half, full = 1 << item.bits - 1, 1 << item.bits
    return lambda bits: bits - full if bits >= half else bits


def _encoder(item: PdoObject) -> _Encode:
    if _is_real(item) and item.type is not None:
        real, whole = (struct.Struct(form) for form in _REALS[item.type])
        return lambda value: int(whole.unpack(real.pack(value))[0])
    return int


def _is_real(item: PdoObject) -> bool:
    return item.type in _REALS and item.type.bits == item.bits
