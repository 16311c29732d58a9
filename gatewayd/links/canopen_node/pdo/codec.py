"""The content of one PDO: image values to bytes and bytes to changes, compiled once per mapping.

Entries follow each other bit by bit, least significant bit of the first byte first, numbers little-endian (CiA 301,
7.3.2 and 7.1.1). Only BOOLEANs may lie off a byte boundary, so a mapping is a row of numbers and of runs of bits:
numbers go through one `struct`, each run of bits through one integer.

A scaled variable goes as raw number: value = raw * scale + offset, as in a register. A number that the type cannot
hold becomes the nearest one that it can (`gatewayd.links.canopen_values.fit`).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any, Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.admission import Change, contradiction
from gatewayd.core.definition import Value, ValueKind, Variable
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.encoding.bits import unpacked
from gatewayd.links.canopen_values import fit, limits_of, meaning

MAX_BITS: Final = 64
"""What one CAN frame carries."""

_DIGITS: Final = b"0" + b"1" * 255
"""Truth of a byte as a binary digit, for `bytes.translate`."""


@dataclass(frozen=True, slots=True)
class Mapped:
    """One entry of a mapping."""

    variable: int | None
    """Index of the variable; None for a word of the status block, and for a dummy entry (no BOOLEAN), which is skipped
    on reception, 0 on transmission."""
    type: CanType
    offset: int | None = None
    """Where the status block has it."""
    linear: tuple[float, float] | None = None
    """Scale and offset of the variable; None: its values go as they are."""

    @property
    def is_dummy(self) -> bool:
        """Whether it holds nothing."""
        return self.variable is None and self.offset is None


def is_aligned(types: Iterable[CanType]) -> bool:
    """Whether entries of these types, one after the other, leave only BOOLEANs off a byte boundary."""
    position = 0
    for can_type in types:
        if can_type is not CanType.BOOLEAN and position % 8:
            return False
        position += can_type.bits
    return True


Gather = Callable[[Sequence[Value]], Sequence[Value]]
ReadWord = Callable[[int, int], int]
"""Reads so many words of the status block from that offset on, as one number."""


class Layout:
    """A compiled mapping of at most 64 bits, aligned as `is_aligned` says."""

    def __init__(self, mapping: Sequence[Mapped], variables: Sequence[Variable]) -> None:
        types = [entry.type for entry in mapping]
        bits = sum(can_type.bits for can_type in types)
        assert bits <= MAX_BITS
        assert is_aligned(types)
        assert all(entry.variable is not None for entry in mapping if entry.type is CanType.BOOLEAN)
        self.size = (bits + 7) // 8
        """Bytes."""
        self.variables = tuple(entry.variable for entry in mapping if entry.variable is not None)
        """Variables in the order of the mapping, without dummies and status words."""
        self.content = tuple(entry for entry in mapping if not entry.is_dummy)
        """What a PDO holds, in the order of the mapping."""
        self.gather: Gather = _gatherer(self.variables)
        """Copies the content out of an image's values: what `pack` takes, and comparable with `==`. For a mapping with
        status words `gatherer` makes it."""
        runs = list(_runs(mapping))
        compiled = struct.Struct("<" + "".join(run.format for run in runs))
        self._pack = compiled.pack
        self._unpack = compiled.unpack
        self._runs = tuple(_slices(runs)) if any(run.size for run in runs) else None
        self._receivers = tuple(run.receiver(variables) for run in runs if run.values)
        self._is_scaled = any(entry.linear is not None for entry in mapping)
        self._is_repeated = len(set(self.variables)) < len(self.variables)

    @property
    def has_status(self) -> bool:
        """Whether it carries words of the status block."""
        return len(self.content) > len(self.variables)

    def gatherer(self, read: ReadWord) -> Gather:
        """What copies the content together where some of it is in the status block."""
        if not self.has_status:
            return self.gather
        places = [(entry.variable, entry.offset or 0, entry.type.bits // 16) for entry in self.content]

        def gather(values: Sequence[Value]) -> tuple[Value, ...]:
            return tuple(
                values[variable] if variable is not None else read(offset, words)
                for variable, offset, words in places
            )

        return gather

    def pack(self, content: Sequence[Value]) -> bytes:
        """The PDO's bytes for what `gather` returned."""
        if not self._is_scaled:
            with suppress(struct.error, OverflowError, ValueError, TypeError):
                return self._packed(content)
        return self._packed(
            [fit(value, entry.type, entry.linear) for value, entry in zip(content, self.content, strict=True)]
        )

    def values(self, data: bytes) -> list[Value] | Refusal:
        """What `size` bytes say, for `variables`. A refusal says which variable has no value for what was received."""
        values: list[Value] = []
        for receive, raw in zip(self._receivers, self._unpack(data), strict=True):
            refusal = receive(raw, values)
            if refusal is not None:
                return refusal
        return values

    def changes(self, data: bytes) -> list[Change] | Refusal:
        """What they mean for the cell. Every bit is meant: who maps it into an RPDO sends it on purpose.

        Refused also if a variable is given two values.
        """
        values = self.values(data)
        return values if isinstance(values, Refusal) else self.meant(values)

    def meant(self, values: Sequence[Value]) -> list[Change] | Refusal:
        """The same of what `values` returned."""
        changes = [Change(variable, value) for variable, value in zip(self.variables, values, strict=True)]
        return (contradiction(changes) if self._is_repeated else None) or changes

    def _packed(self, content: Sequence[Value]) -> bytes:
        if self._runs is None:
            return self._pack(*content)
        arguments: list[Value | bytes] = []
        for span, size in self._runs:
            if size:
                digits = bytes(content[span])[::-1].translate(_DIGITS)  # type: ignore[arg-type]  # bits, or a TypeError
                arguments.append(int(digits, 2).to_bytes(size, "little"))
            else:
                arguments += content[span]
        return self._pack(*arguments)


def _gatherer(variables: Sequence[int]) -> Gather:
    if not variables:
        return lambda _values: ()
    first, last = variables[0], variables[-1]
    if tuple(variables) == tuple(range(first, last + 1)):
        return itemgetter(slice(first, last + 1))
    return itemgetter(*variables)


@dataclass(frozen=True, slots=True)
class _Run:
    """Neighbours of a mapping that are handled together: one number, one dummy, or BOOLEANs."""

    mapped: tuple[Mapped, ...]
    size: int
    """Bytes of a run of bits; 0 for a number or a dummy."""

    @property
    def format(self) -> str:
        """Its part of the `struct` format."""
        if self.size:
            return f"{self.size}s"
        number = self.mapped[0]
        return number.type.char if not number.is_dummy else f"{number.type.bits // 8}x"

    @property
    def values(self) -> int:
        """How many values of the content it takes."""
        return sum(not entry.is_dummy for entry in self.mapped)

    def receiver(self, variables: Sequence[Variable]) -> Receive:
        """What takes its value when a PDO is received."""
        members = [entry.variable for entry in self.mapped if entry.variable is not None]
        if self.size:
            return _bit_receiver(members, variables)
        if members:
            return _number_receiver(members[0], self.mapped[0], variables[members[0]])
        return lambda _raw, _changes: None  # a word of the status block, which is only sent


def _runs(mapping: Sequence[Mapped]) -> Iterator[_Run]:
    for is_bits, group in groupby(mapping, key=lambda entry: entry.type is CanType.BOOLEAN):
        entries = tuple(group)
        if is_bits:
            yield _Run(entries, (len(entries) + 7) // 8)
        else:
            yield from (_Run((entry,), 0) for entry in entries)


def _slices(runs: Iterable[_Run]) -> Iterator[tuple[slice, int]]:
    """Where each run lies in the content; with its bytes for bits, 0 for numbers."""
    position = 0
    for run in runs:
        yield slice(position, position + run.values), run.size
        position += run.values


Receive = Callable[[Any, list[Value]], Refusal | None]
"""Appends what an item of the unpacked PDO says to the values, or returns why not."""


def _number_receiver(variable: int, mapped: Mapped, declared: Variable) -> Receive:
    can_type, linear = mapped.type, mapped.linear
    kind, reader = declared.kind, limits_of(declared, can_type, linear)
    is_direct = linear is None and kind is (ValueKind.FLOAT if can_type.is_real else ValueKind.INT)
    read = reader.read if reader is not None else meaning(kind, linear)
    # Without limits to mind every number is between these; only infinities and NaN are read to come out the same.
    below, above = (reader.below, reader.above) if reader is not None else (-math.inf, math.inf)

    def receive(raw: Any, values: list[Value]) -> Refusal | None:
        value = raw if is_direct and below < raw < above else read(raw)
        if value is None:
            return Refusal(Reason.OUT_OF_LIMITS, variable)
        values.append(value)
        return None

    return receive


def _bit_receiver(members: Sequence[int], variables: Sequence[Variable]) -> Receive:
    """Bits of variables that are no truths are numbers."""
    count, kinds = len(members), [variables[index].kind for index in members]
    truth = {ValueKind.BOOL: bool, ValueKind.INT: int, ValueKind.FLOAT: float}
    convert = None if set(kinds) == {ValueKind.BOOL} else [truth[kind] for kind in kinds]

    def receive(raw: Any, values: list[Value]) -> None:
        bits = unpacked(raw, count)
        values += bits if convert is None else [kind(bit) for kind, bit in zip(convert, bits, strict=True)]

    return receive
