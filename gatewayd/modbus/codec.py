"""Numbers in 16-bit Modbus registers: one codec for both directions, worked out once per placement.

`raw = (value - offset) / scale`, `value = raw * scale + offset`. Orders by the bytes of a 32-bit number:
`ABCD` big-endian (Application Protocol V1.1b3, 4.2), `CDAB` words swapped, `BADC` bytes swapped in each word,
`DCBA` both; 64-bit numbers alike over four words. Numbers of one register know only the byte swap (`turns`).

Encoding saturates: a value beyond the register type becomes the nearest number that the type holds, NaN
becomes 0 in an integer. A float32 beyond its range becomes the greatest finite one; infinities stay what they
are in reals. Halves round to even. A `bool` register is written 0 or 1, and every number but 0 reads as true.

Decoding gives a declared limit for the raw number nearest to it (`gatewayd.encoding.limits`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from struct import Struct, calcsize
from typing import Final, TypeAlias

from gatewayd.core.definition import Value, ValueKind
from gatewayd.encoding.limits import Ends, LimitReader, Meaning, ends_of, read_limits
from gatewayd.encoding.linear import meaning_of, saturated, whole

Buffer: TypeAlias = bytes | bytearray | memoryview

ORDERS: Final = {"ABCD": (">", False), "CDAB": ("<", True), "BADC": (">", True), "DCBA": ("<", False)}
"""Word and byte orders: byte order of `struct`, and whether the two bytes of every word are exchanged after it."""


@dataclass(frozen=True, slots=True)
class NumberFormat:
    """A number type of Modbus registers."""

    name: str
    code: str
    """`struct` format character."""
    words: int
    """Registers; a byte lies in one with another beside it."""
    low: float
    """Least number; for reals the negative of the greatest finite one."""
    high: float

    @property
    def is_byte(self) -> bool:
        """Whether it is one byte of a register."""
        return self.code in "bB"

    @property
    def size(self) -> int:
        """Bytes."""
        return calcsize(f">{self.code}")

    @property
    def is_real(self) -> bool:
        """Whether it is an IEEE 754 number."""
        return self.code in "fd"


_FLOAT32_MAXIMUM: Final = float.fromhex("0x1.fffffep+127")
_FLOAT64_MAXIMUM: Final = float.fromhex("0x1.fffffffffffffp+1023")

TYPES: Final = {
    number.name: number
    for number in (
        NumberFormat("bool", "H", 1, 0, 1),
        NumberFormat("int8", "b", 1, -(1 << 7), (1 << 7) - 1),
        NumberFormat("uint8", "B", 1, 0, (1 << 8) - 1),
        NumberFormat("int16", "h", 1, -(1 << 15), (1 << 15) - 1),
        NumberFormat("uint16", "H", 1, 0, (1 << 16) - 1),
        NumberFormat("int32", "i", 2, -(1 << 31), (1 << 31) - 1),
        NumberFormat("uint32", "I", 2, 0, (1 << 32) - 1),
        NumberFormat("int64", "q", 4, -(1 << 63), (1 << 63) - 1),
        NumberFormat("uint64", "Q", 4, 0, (1 << 64) - 1),
        NumberFormat("float32", "f", 2, -_FLOAT32_MAXIMUM, _FLOAT32_MAXIMUM),
        NumberFormat("float64", "d", 4, -_FLOAT64_MAXIMUM, _FLOAT64_MAXIMUM),
    )
}
"""Number types by name; `bit` has no registers of its own and no codec."""


@dataclass(frozen=True, slots=True)
class Codec:
    """How one variable's number is written in registers. Made by `make_codec`."""

    type: str
    order: str
    scale: float
    offset: float
    kind: ValueKind
    """Kind of the robot's values."""
    words: int
    """Registers covered."""
    struct_code: str | None
    """`struct` character that does the same as `encode` for every value of the robot's type, else None.

    Runs of neighbours that have one may be packed by one big-endian `struct`, values as they are.
    """
    ends: Ends
    """Least and greatest value that `decode` gives exactly; None: they need no care."""
    window: tuple[float, float]
    """Between which raw numbers, both excluded, `read` is what scale and offset say, or the raw number itself."""
    encode: Callable[[Value], bytes] = field(compare=False, repr=False)
    """Value in the robot's unit -> the type's bytes as they go over the wire. Never raises for numbers."""
    decode: Callable[[Buffer], Value | None] = field(compare=False, repr=False)
    """These bytes -> value in the robot's unit; None for what the robot's kind has no value for (NaN as INT).

    Whether the robot's type is wide enough is for `Variable.low` and `.high` to say. Raises `struct.error`
    for another number of bytes.
    """
    read: Callable[[float], Value | None] = field(compare=False, repr=False)
    """The same of the raw number."""

    @property
    def meaning(self) -> list[object]:
        """What a mapping says of it; the rest follows from the variable."""
        return [self.type, self.order, self.scale, self.offset]

    @property
    def is_direct(self) -> bool:
        """Whether raw numbers in the window are values of the robot's kind as they are."""
        number = TYPES[self.type]
        kind = ValueKind.FLOAT if number.is_real else ValueKind.INT
        return (self.scale, self.offset) == (1, 0) and self.kind is kind and number.name != "bool"

    def __reduce__(self) -> tuple[Callable[..., Codec], tuple[object, ...]]:
        """Between processes it travels as what it was made of: its functions cannot."""
        form, linear = (self.type, self.order), (self.scale, self.offset)
        return _compiled, (form, self.kind, linear, self.struct_code, self.ends)


def turns(order: str, type_name: str) -> bool:
    """Whether `order` says anything of a number of that type: in one register there are no words to swap."""
    number = TYPES[type_name]
    return number.words > 1 or (order in _BYTE_SWAPS and number.size > 1 and number.name != "bool")


_BYTE_SWAPS: Final = frozenset({"BADC", "DCBA"})


def make_codec(
    type_name: str,
    order: str = "ABCD",
    *,
    kind: ValueKind,
    scale: float = 1.0,
    offset: float = 0.0,
    low: float | None = None,
    high: float | None = None,
    limits: tuple[float, float] | None = None,
) -> Codec:
    """Compile a codec for a robot value of `kind` between `low` and `high` (None: unknown), written within `limits`.

    Raises KeyError for an unknown type or order and ValueError for a scale that cannot be undone.
    """
    number = TYPES[type_name]
    if not (math.isfinite(scale) and math.isfinite(offset)) or scale == 0:
        raise ValueError(f"scale {scale} and offset {offset} cannot be undone")
    is_plain = scale == 1 and offset == 0 and (order == "ABCD" or (number.words == 1 and order == "CDAB"))
    merged = is_plain and _is_lossless(number, kind, low, high)
    ends = _NO_ENDS if type_name == "bool" else ends_of(kind, limits, low, high)
    return _compiled((type_name, order), kind, (scale, offset), number.code if merged else None, ends)


_NO_ENDS: Final[Ends] = (None, None)


@lru_cache(maxsize=4096)
def _compiled(
    form: tuple[str, str], kind: ValueKind, linear: tuple[float, float], struct_code: str | None, ends: Ends
) -> Codec:
    (type_name, order), (scale, offset) = form, linear
    number = TYPES[type_name]
    byte_order, swapped = ORDERS[order]
    layout = Struct(byte_order + number.code)
    pack, unpack = _swapping(layout) if swapped and not number.is_byte else (layout.pack, layout.unpack)
    plain = scale == 1 and offset == 0
    encode = _plain_encoder(number, pack, kind) if plain else _encoder(number, pack, scale, offset)
    read = _meaning(number, scale, offset, kind)
    reader = read_limits(ends, number.code, read, scale, offset)
    window = (-math.inf, math.inf)
    if reader is not None:
        decode = _limited_decoder(unpack, scale, offset, kind, reader)
        window, read = (reader.below, reader.above), reader.read
    else:
        ends = _NO_ENDS
        decode = _plain_decoder(number, unpack, kind) if plain else _decoder(unpack, scale, offset, kind)
    return Codec(
        type_name, order, scale, offset, kind, number.words, struct_code, ends, window, encode, decode, read
    )


def _is_lossless(number: NumberFormat, kind: ValueKind, low: float | None, high: float | None) -> bool:
    if kind is ValueKind.FLOAT:
        return number.code == "d"
    if kind is ValueKind.BOOL or number.is_real or low is None or high is None:
        return False
    return number.low <= low and high <= number.high


Pack: TypeAlias = "Callable[[Value], bytes]"
Unpack: TypeAlias = "Callable[[Buffer], tuple[int | float, ...]]"


def _swapping(layout: Struct) -> tuple[Pack, Unpack]:
    return (lambda value: swap(layout.pack(value))), (lambda data: layout.unpack(swap(data)))


def swap(data: Buffer) -> bytes:
    """Exchange the two bytes of every word."""
    out = bytearray(data)
    out[0::2], out[1::2] = data[1::2], data[0::2]
    return bytes(out)


def _plain_encoder(number: NumberFormat, pack: Pack, kind: ValueKind) -> Pack:
    """Encode without arithmetic, so that 64-bit integers keep every digit."""
    if number.name == "bool":
        return lambda value: pack(bool(value))
    if number.is_real:
        return _real_packer(number, pack)
    low, high = int(number.low), int(number.high)
    if kind is ValueKind.FLOAT:
        return lambda value: pack(saturated(value, low, high))

    def encode(value: Value) -> bytes:
        return pack(low if value < low else high if value > high else int(value))

    return encode


def _encoder(number: NumberFormat, pack: Pack, scale: float, offset: float) -> Pack:
    if number.is_real:
        pack_real = _real_packer(number, pack)
        return lambda value: pack_real((value - offset) / scale)
    low, high = int(number.low), int(number.high)
    return lambda value: pack(saturated((value - offset) / scale, low, high))


def _real_packer(number: NumberFormat, pack: Pack) -> Pack:
    high = number.high

    def encode(value: Value) -> bytes:
        try:
            return pack(value)
        except OverflowError:
            return pack(high if value > 0 else -high)

    return encode


Decode: TypeAlias = "Callable[[Buffer], Value | None]"


def _plain_decoder(number: NumberFormat, unpack: Unpack, kind: ValueKind) -> Decode:
    if kind is ValueKind.FLOAT and number.name != "bool":
        return lambda data: float(unpack(data)[0])
    if kind is ValueKind.INT and not number.is_real and number.name != "bool":
        return lambda data: unpack(data)[0]
    meaning = _meaning(number, 1.0, 0.0, kind)
    return lambda data: meaning(unpack(data)[0])


def _decoder(unpack: Unpack, scale: float, offset: float, kind: ValueKind) -> Decode:
    if kind is ValueKind.FLOAT:
        return lambda data: unpack(data)[0] * scale + offset
    if kind is ValueKind.BOOL:
        return lambda data: unpack(data)[0] * scale + offset != 0
    return lambda data: whole(unpack(data)[0] * scale + offset)


def _limited_decoder(
    unpack: Unpack, scale: float, offset: float, kind: ValueKind, reader: LimitReader
) -> Decode:
    """Decode with care at the limits; between them a comparison is all that it costs."""
    below, above, read, meaning = reader.below, reader.above, reader.read, reader.meaning

    def decode_real(data: Buffer) -> Value | None:
        (raw,) = unpack(data)
        return raw * scale + offset if below < raw < above else read(raw)

    def decode(data: Buffer) -> Value | None:
        (raw,) = unpack(data)
        return meaning(raw) if below < raw < above else read(raw)

    return decode_real if kind is ValueKind.FLOAT else decode


def _meaning(number: NumberFormat, scale: float, offset: float, kind: ValueKind) -> Meaning:
    """What a raw number is in the robot's unit."""
    if number.name == "bool" and scale == 1 and offset == 0:
        truth = _TRUTH[kind]
        return lambda raw: truth[raw != 0]
    return meaning_of(kind, scale, offset)


_TRUTH: Final[dict[ValueKind, tuple[Value, Value]]] = {
    ValueKind.BOOL: (False, True),
    ValueKind.INT: (0, 1),
    ValueKind.FLOAT: (0.0, 1.0),
}
