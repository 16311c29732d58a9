"""Numbers and bits that come in one request, decoded together.

Where each codec would unpack its registers by itself, one `struct` does it for all that have one byte order, and what
is done with the numbers is done by loops in C.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, groupby
from operator import add, itemgetter, mul
from typing import Any, TypeAlias

from gatewayd.core.definition import Value, ValueKind
from gatewayd.encoding.bits import BITS_OF, unpacked
from gatewayd.modbus.codec import ORDERS, TYPES, Buffer, Codec, swap

Bounds: TypeAlias = tuple[float, float]


@dataclass(frozen=True, slots=True)
class BitWord:
    """Bits of one register."""

    word: int
    """Position of the register in the request."""
    bits: tuple[int, ...]
    """Which bits are wanted, in this order; 0 is the least significant."""
    others: int = 0
    """Bits that may not be 1."""


class Block:
    """What a request of so many registers holds."""

    def __init__(self, numbers: Sequence[tuple[int, Codec]], bits: Sequence[BitWord] = ()) -> None:
        """`numbers`: the position of each number's first register, in ascending order, and its codec."""
        groups: dict[tuple[str, bool], list[int]] = {}
        for index, (_word, codec) in enumerate(numbers):
            groups.setdefault(_layout(codec), []).append(index)
        self.order = tuple(chain.from_iterable(groups.values()))
        """Which of the numbers `decode` gives first, second, and so on; the bits come after them."""
        self._groups = tuple(
            (_unpacker(order, [numbers[index] for index in members]), is_swapped)
            for (order, is_swapped), members in groups.items()
        )
        codecs = [numbers[index][1] for index in self.order]
        self.bounds = tuple(_bounds(codec) for codec in codecs)
        """For each number that `decode` gives: least and greatest that is what its codec makes of the registers.

        One that lies outside is to be decoded by its codec: it may mean a limit. The caller compares, who has limits to
        compare with anyway.
        """
        self._convert = _converter(codecs)
        self._bits = tuple((2 * word.word, word.others, _picker(word.bits)) for word in bits)

    def decode(self, data: bytes) -> list[Value] | None:
        """The numbers in `order`, then the bits, word by word; within `bounds` they are what the codecs make of them.

        None: something has no value, or a bit is 1 that may not be.
        """
        groups = self._groups
        if len(groups) == 1:
            ((unpack, is_swapped),) = groups
            raws = unpack(swap(data) if is_swapped else data)
        else:
            raws = tuple(
                chain.from_iterable(
                    unpack(swap(data) if is_swapped else data) for unpack, is_swapped in groups
                )
            )
        values = self._convert(raws)
        if values is not None:
            for position, others, pick in self._bits:
                high, low = data[position : position + 2]
                if others and (high << 8 | low) & others:
                    return None
                values += pick(BITS_OF[low] + BITS_OF[high])
        return values


_Raws = tuple[Any, ...]
_Convert = Callable[[_Raws], "list[Value] | None"]


def _layout(codec: Codec) -> tuple[str, bool]:
    """Byte order of `struct`, and whether bytes are swapped before; numbers of one register mostly have no order."""
    byte_order, is_swapped = ORDERS[codec.order]
    if codec.words == 1 and is_swapped == (byte_order == "<"):
        return ">", False
    return byte_order, is_swapped


def _unpacker(byte_order: str, numbers: Iterable[tuple[int, Codec]]) -> Callable[[Buffer], _Raws]:
    codes: list[str] = []
    behind = 0
    for word, codec in numbers:
        codes.append(f"{2 * (word - behind)}x{TYPES[codec.type].code}")
        behind = word + codec.words
    return struct.Struct(byte_order + "".join(codes)).unpack_from


def _bounds(codec: Codec) -> Bounds:
    """The values of the raw numbers next to the ends of the window, towards its middle, or less.

    The values ascend, or descend, with the raw numbers. So a value that is not as far out as that of the window's end
    comes from a raw number in the window.
    """
    ends = [raw if codec.is_direct else raw * codec.scale + codec.offset for raw in codec.window]
    is_open = [math.isinf(raw) for raw in codec.window]
    if codec.scale < 0:
        ends.reverse()
        is_open.reverse()
    low = -math.inf if is_open[0] else _beside(codec.kind, ends[0], math.inf)
    high = math.inf if is_open[1] else _beside(codec.kind, ends[1], -math.inf)
    return low, high


def _beside(kind: ValueKind, value: float, towards: float) -> float:
    """The next value of a number's kind in that direction."""
    if kind is ValueKind.INT and math.isfinite(value):
        return round(value) + (1 if towards > 0 else -1)
    return math.nextafter(value, towards)


_ROUNDABLE = 1e200
"""Scale and offset up to which every integer of a register is finite afterwards."""
_MOST_RUNS = 4
"""Runs of numbers that are converted alike, up to which a loop in C for each is quicker than one over all."""


def _converter(codecs: Sequence[Codec]) -> _Convert:
    """What makes values of raw numbers; None: something has no value."""
    runs = [(convert, list(run)) for convert, run in groupby(codecs, key=_loop)]
    if len(runs) > _MOST_RUNS or any(loop is None for loop, _run in runs):
        return partial(_one_by_one, tuple(map(_reader, codecs)))
    loops: list[tuple[slice, _Convert]] = []
    first = 0
    for loop, run in runs:
        assert loop is not None
        loops.append((slice(first, first + len(run)), loop(run)))
        first += len(run)
    if len(loops) == 1:
        return loops[0][1]

    def convert(raws: _Raws) -> list[Value]:
        values: list[Value] = []
        for part, convert_run in loops:
            values += convert_run(raws[part]) or ()
        return values

    return convert


def _loop(codec: Codec) -> Callable[[Sequence[Codec]], _Convert] | None:
    """What makes a loop for neighbours of this kind; None: each is to be converted by its codec."""
    if codec.is_direct:
        return _as_they_are
    if codec.type == "bool" or codec.kind is ValueKind.BOOL:
        return None
    if codec.kind is ValueKind.FLOAT:
        return _scaled
    if TYPES[codec.type].is_real or abs(codec.scale) > _ROUNDABLE or abs(codec.offset) > _ROUNDABLE:
        return None
    return _scaled_and_rounded


def _as_they_are(_codecs: Sequence[Codec]) -> _Convert:
    return list


def _scaled(codecs: Sequence[Codec]) -> _Convert:
    scales, offsets = _linear(codecs)
    return lambda raws: list(map(add, map(mul, raws, scales), offsets))


def _scaled_and_rounded(codecs: Sequence[Codec]) -> _Convert:
    scales, offsets = _linear(codecs)
    return lambda raws: list(map(round, map(add, map(mul, raws, scales), offsets)))


def _linear(codecs: Sequence[Codec]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(codec.scale for codec in codecs), tuple(codec.offset for codec in codecs)


def _one_by_one(reads: Sequence[Callable[[float], Value | None]], raws: _Raws) -> list[Value] | None:
    values = [read(raw) for read, raw in zip(reads, raws, strict=True)]
    return None if None in values else values  # type: ignore[return-value]  # no None is among them


def _reader(codec: Codec) -> Callable[[float], Value | None]:
    if not codec.is_direct:
        return codec.read
    return float if codec.kind is ValueKind.FLOAT else int


def _picker(bits: Sequence[int]) -> Callable[[tuple[bool, ...]], Sequence[bool]]:
    """Takes these of the 16 bits of a register."""
    if len(bits) == 1:
        (only,) = bits
        return lambda word: (word[only],)
    return itemgetter(*bits)


def coils(data: bytes, count: int) -> list[Value]:
    """So many coils, as a request packs them: the first one in the least significant bit of the first byte."""
    return list(unpacked(data, count))
