"""Encoding of values into the words and bits of a unit: neighbours are written together, and only what changed.

A run takes its variables' values from the process image, compares them with those it wrote last, and packs all of
them with one `struct` call if any differs. A zero that only changed its sign counts as unchanged.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from operator import itemgetter, mul
from typing import Protocol

from gatewayd.core.definition import Value
from gatewayd.links.modbus_server.plan import Placement
from gatewayd.modbus.codec import Codec

_Getter = Callable[[list[Value]], Sequence[Value]]


class Run(Protocol):
    """Something that brings a part of a unit's image up to date."""

    def refresh(self, values: list[Value]) -> None:
        """Encode what changed in `values`, the values of all variables by index."""


class NumberRun:
    """Numbers in consecutive registers."""

    __slots__ = ("_get", "_image", "_last", "_offset", "_pack", "_parts")

    def __init__(self, placements: Sequence[Placement], image: bytearray) -> None:
        self._image = image
        self._offset = 2 * placements[0].address
        self._get = _getter([placement.variable for placement in placements])
        self._parts = [_codec(placement) for placement in placements]
        codes = [codec.struct_code for codec in self._parts]
        plain = [code for code in codes if code is not None]
        self._pack = struct.Struct(">" + "".join(plain)).pack_into if len(plain) == len(codes) else None
        self._last: Sequence[Value] = ()

    def refresh(self, values: list[Value]) -> None:
        """Encode all numbers of the run if one of them changed."""
        present = self._get(values)
        if present == self._last:
            return
        self._last = present
        if self._pack is not None:
            try:
                self._pack(self._image, self._offset, *present)
            except (struct.error, OverflowError):
                pass
            else:
                return
        self._encode_one_by_one(present)

    def _encode_one_by_one(self, present: Sequence[Value]) -> None:
        """The codec knows what becomes of a number that the type cannot hold; `struct` does not."""
        start = self._offset
        for codec, value in zip(self._parts, present, strict=True):
            end = start + 2 * codec.words
            self._image[start:end] = codec.encode(value)
            start = end


class WordOfBits:
    """The mapped bits and bytes of one register; the other bits are always 0."""

    __slots__ = ("_bytes", "_get", "_image", "_last", "_masks", "_offset")

    def __init__(self, placements: Sequence[Placement], image: bytearray) -> None:
        self._image = image
        self._offset = 2 * placements[0].address
        self._get = _getter([placement.variable for placement in placements])
        self._masks = [1 << (placement.bit or 0) for placement in placements]
        self._bytes = [(n, placement.codec) for n, placement in enumerate(placements) if placement.codec]
        self._last: Sequence[Value] = ()

    def refresh(self, values: list[Value]) -> None:
        """Write the register anew if a part changed."""
        present = self._get(values)
        if present == self._last:
            return
        self._last = present
        if self._bytes:
            word = sum(map(mul, self._masks, self._encoded(present)))
        else:
            word = sum(mask for mask, value in zip(self._masks, present, strict=True) if value)
        self._image[self._offset : self._offset + 2] = word.to_bytes(2, "big")

    def _encoded(self, present: Sequence[Value]) -> list[int]:
        parts = [int(bool(value)) for value in present]
        for position, codec in self._bytes:
            parts[position] = codec.encode(present[position])[0]
        return parts


class BitRun:
    """Consecutive coils or discrete inputs, packed from the least significant bit of a byte on."""

    __slots__ = ("_bytes", "_get", "_image", "_keep", "_last", "_shift")

    def __init__(self, placements: Sequence[Placement], image: bytearray) -> None:
        first, behind = placements[0].address, placements[-1].address + 1
        self._image = image
        self._bytes = slice(first >> 3, (behind + 7) >> 3)
        self._shift = first & 7
        self._keep = ~(((1 << len(placements)) - 1) << self._shift)
        self._get = _getter([placement.variable for placement in placements])
        self._last: Sequence[Value] = ()

    def refresh(self, values: list[Value]) -> None:
        """Write all bits of the run anew if one of them changed."""
        present = self._get(values)
        if present == self._last:
            return
        self._last = present
        bits = sum(1 << position for position, value in enumerate(present, self._shift) if value)
        covered = self._image[self._bytes]
        kept = int.from_bytes(covered, "little") & self._keep
        self._image[self._bytes] = (kept | bits).to_bytes(len(covered), "little")


def number_runs(placements: Iterable[Placement], image: bytearray) -> list[Run]:
    """Runs over whole-register placements: plain neighbours together, everything else alone."""
    return [NumberRun(group, image) for group in _neighbours(placements, _plain_neighbours)]


def bit_runs(placements: Iterable[Placement], image: bytearray) -> list[Run]:
    """Runs over coils or discrete inputs."""
    return [BitRun(group, image) for group in _neighbours(placements, _next_to)]


def words_of_bits(placements: Iterable[Placement], image: bytearray) -> list[Run]:
    """One run for each register that bits are packed into."""
    return [WordOfBits(group, image) for group in _neighbours(placements, _same_word)]


def _neighbours(
    placements: Iterable[Placement], together: Callable[[Placement, Placement], bool]
) -> Iterator[list[Placement]]:
    ordered = sorted(placements, key=lambda placement: placement.address)
    if not ordered:
        return
    group = ordered[:1]
    for before, placement in pairwise(ordered):
        if not together(before, placement):
            yield group
            group = []
        group.append(placement)
    yield group


def _next_to(before: Placement, placement: Placement) -> bool:
    return before.address + before.words == placement.address


def _plain_neighbours(before: Placement, placement: Placement) -> bool:
    plain = _codec(before).struct_code is not None and _codec(placement).struct_code is not None
    return plain and _next_to(before, placement)


def _same_word(before: Placement, placement: Placement) -> bool:
    return before.address == placement.address


def _codec(placement: Placement) -> Codec:
    if placement.codec is None:
        raise ValueError(f"placement at {placement.area.notation(placement.address)} has no number encoding")
    return placement.codec


def _getter(variables: list[int]) -> _Getter:
    """Takes the values of `variables` out of the image: by a slice where they follow each other."""
    first, behind = variables[0], variables[-1] + 1
    if variables == list(range(first, behind)):
        return itemgetter(slice(first, behind))
    return itemgetter(*variables)
