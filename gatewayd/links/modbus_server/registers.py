"""The four Modbus data tables of one unit: what its addresses hold, and what a write to them means.

Registers lie in one `bytearray` of big-endian words per table, so that a read is a slice; coils and discrete inputs
are packed eight to a byte in the order of the protocol.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from gatewayd.core.admission import Change, contradiction
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.status_layout import BASE
from gatewayd.links.modbus_server.plan import ModbusPlan, Placement
from gatewayd.links.modbus_server.readable import ADDRESSES, Readable
from gatewayd.links.modbus_server.repeated import Repeated
from gatewayd.links.modbus_server.runs import Run, bit_runs, number_runs, words_of_bits
from gatewayd.links.modbus_server.usual import Meaning
from gatewayd.modbus.areas import MAX_READ_BITS, MAX_READ_REGISTERS, Area
from gatewayd.modbus.block import BitWord, Block, coils
from gatewayd.modbus.codec import Codec

GAPS = range(BASE)
"""Addresses at which gaps may read 0 or be written to without effect; from there on is the status block."""
_NO_GAPS = range(0)
_WORD = struct.Struct(">H")


@dataclass(frozen=True, slots=True, eq=False)
class _Number:
    """A variable that fills whole registers."""

    address: int
    words: int
    variable: int
    writable: bool
    codec: Codec

    def changes(self, data: bytes) -> list[Change] | Reason:
        """Refused if the words mean nothing that the variable could hold."""
        value = self.codec.decode(data)
        return Reason.OUT_OF_LIMITS if value is None else [Change(self.variable, value)]

    def masked(self, present: int, and_mask: int, or_mask: int) -> list[Change] | Reason:
        word = (present & and_mask) | (or_mask & ~and_mask & 0xFFFF)
        return self.changes(_WORD.pack(word))


@dataclass(frozen=True, slots=True)
class _Byte:
    """A number in a byte of a register."""

    mask: int
    variable: int
    implied: bool
    """As those of bits."""
    codec: Codec
    values: Sequence[Value]
    """The process image."""

    def change(self, word: int) -> Change | None:
        """None if the byte means nothing that the variable could hold.

        What is implied and shows the present value means it, whatever digits the byte has no room for.
        """
        raw = ((word & self.mask) >> (8 if self.mask > 0xFF else 0)).to_bytes()
        present = self.values[self.variable]
        if self.implied and self.codec.encode(present) == raw:
            return Change(self.variable, present, implied=True)
        value = self.codec.decode(raw)
        return None if value is None else Change(self.variable, value, self.implied)


@dataclass(frozen=True, slots=True, eq=False)
class _Bits:
    """A register into which bits and bytes are packed."""

    address: int
    writable: bool
    bits: tuple[tuple[int, int, bool], ...]
    """Mask, variable, and whether it is implied where the whole register is written."""
    unmapped: int
    """Mask of the other bits."""
    ignores_gaps: bool
    numbers: tuple[_Byte, ...] = ()

    @property
    def words(self) -> int:
        return 1

    @property
    def variable(self) -> int:
        return self.bits[0][1] if self.bits else self.numbers[0].variable

    def changes(self, data: bytes) -> list[Change] | Reason:
        """Refused where a 1 would be lost."""
        (word,) = _WORD.unpack(data)
        if word & self.unmapped and not self.ignores_gaps:
            return Reason.NO_SUCH_ADDRESS
        changes = [Change(variable, bool(word & mask), implied) for mask, variable, implied in self.bits]
        return self._with_bytes(changes, word, 0xFFFF) if self.numbers else changes

    def masked(self, present: int, and_mask: int, or_mask: int) -> list[Change] | Reason:
        """Refused where a 1 would be lost, and if it is for unmapped bits alone."""
        selected = ~and_mask & 0xFFFF
        lost = or_mask & selected & self.unmapped
        if (lost and not self.ignores_gaps) or (selected and not selected & ~self.unmapped):
            return Reason.NO_SUCH_ADDRESS
        changes = [
            Change(variable, bool(or_mask & mask))
            for mask, variable, _implied in self.bits
            if selected & mask
        ]
        word = (present & and_mask) | (or_mask & selected)
        return self._with_bytes(changes, word, selected) if self.numbers else changes

    def _with_bytes(self, changes: list[Change], word: int, selected: int) -> list[Change] | Reason:
        for part in self.numbers:
            if selected & part.mask:
                change = part.change(word)
                if change is None:
                    return Reason.OUT_OF_LIMITS
                changes.append(change if selected == 0xFFFF else replace(change, implied=False))
        return changes


class _Table:
    """What may be read of a table."""

    def __init__(self, placements: Sequence[Placement], longest: int, gaps: range) -> None:
        """`gaps`: where addresses with nothing mapped can be read."""
        self._addresses_of: dict[int, set[int]] = {}
        for placement in placements:
            self._addresses_of.setdefault(placement.variable, set()).update(placement.addresses)
        self.readable = Readable(set(gaps).union(*self._addresses_of.values()), longest)

    def hold_back(self, variables: frozenset[int]) -> None:
        """Let reads that touch one of `variables` fail."""
        held = (self._addresses_of[variable] for variable in variables if variable in self._addresses_of)
        self.readable.hold_back(frozenset[int]().union(*held))


class RegisterTable(_Table):
    """Holding registers or input registers."""

    def __init__(
        self, placements: Sequence[Placement], cell: Cell, *, fill_gaps: bool, ignore_gaps: bool
    ) -> None:
        """`fill_gaps` for reading, `ignore_gaps` for writing: registers and bits with nothing mapped are let pass."""
        # In both tables, whatever the mapping has there: clients are advised to read the status block in either.
        super().__init__(placements, MAX_READ_REGISTERS, GAPS if fill_gaps else _NO_GAPS)
        self._ignored = GAPS if ignore_gaps else _NO_GAPS
        self.image = bytearray(2 * ADDRESSES)
        """Big-endian words by address."""
        self._repeated = Repeated(placements)
        self._items: dict[int, _Number | _Bits] = {
            item.address + word: item
            for item in _items(placements, cell, ignore_gaps=ignore_gaps)
            for word in range(item.words)
        }

    def changes(self, address: int, data: bytes) -> list[Change] | Refusal:
        """What writing the big-endian words `data` from `address` on means for the cell.

        Every register must be writable, and mapped unless gaps are ignored; every variable is covered whole.
        """
        end = address + len(data) // 2
        refusal = self._unwritable(range(address, end))
        if refusal is not None:
            return refusal
        changes: list[Change] = []
        position = address
        while position < end:
            item = self._items.get(position)
            if item is None:
                position += 1
                continue
            behind = item.address + item.words
            if position != item.address or behind > end:
                return Refusal(Reason.PARTIAL_VALUE, item.variable)
            start = 2 * (position - address)
            meant = item.changes(data[start : start + 2 * item.words])
            if isinstance(meant, Reason):
                return _refusal(meant, item)
            changes += meant
            position = behind
        return self._repeated.settled(changes, address, data) if self._repeated else changes

    def usual(self, address: int, count: int) -> Meaning | None:
        """What a write that was accepted is, if its data can be decoded in one go."""
        items = dict.fromkeys(self._items.get(position) for position in range(address, address + count))
        numbers: list[tuple[int, _Number]] = []
        words: list[tuple[BitWord, _Bits]] = []
        for item in items:
            if isinstance(item, _Number):
                numbers.append((item.address - address, item))
            elif item is None or item.numbers:
                return None
            else:
                bits = tuple(mask.bit_length() - 1 for mask, _variable, _implied in item.bits)
                words.append((BitWord(item.address - address, bits, item.unmapped), item))
        block = Block([(at, item.codec) for at, item in numbers], [word for word, _item in words])
        variables = [numbers[index][1].variable for index in block.order]
        variables += [variable for _word, item in words for _mask, variable, _implied in item.bits]
        return Meaning(tuple(variables), block.decode, block.bounds)

    def masked(self, address: int, and_mask: int, or_mask: int) -> list[Change] | Refusal:
        """What Mask Write Register means: (present AND and_mask) OR (or_mask AND NOT and_mask).

        Of packed bits only those are written that `and_mask` selects with a 0.
        """
        refusal = self._unwritable(range(address, address + 1))
        if refusal is not None:
            return refusal
        item = self._items[address]
        if item.words > 1:
            return Refusal(Reason.PARTIAL_VALUE, item.variable)
        (present,) = _WORD.unpack_from(self.image, 2 * address)
        meant = item.masked(present, and_mask, or_mask)
        return _refusal(meant, item) if isinstance(meant, Reason) else contradiction(meant) or meant

    def ignored(self, address: int, data: bytes) -> int:
        """Registers, and ones of bits, that such a write covers without effect."""
        count = 0
        for position, (word,) in enumerate(_WORD.iter_unpack(data), address):
            item = self._items.get(position)
            if item is None:
                count += 1
            elif isinstance(item, _Bits):
                count += (word & item.unmapped).bit_count()
        return count

    def _unwritable(self, addresses: range) -> Refusal | None:
        read_only: Refusal | None = None
        meets_any = False
        for address in addresses:
            item = self._items.get(address)
            if item is None:
                if address not in self._ignored:
                    return Refusal(Reason.NO_SUCH_ADDRESS)
                continue
            meets_any = True
            if not item.writable and read_only is None:
                read_only = Refusal(Reason.NOT_WRITABLE, item.variable)
        return read_only if meets_any else Refusal(Reason.NO_SUCH_ADDRESS)


class BitTable(_Table):
    """Coils or discrete inputs."""

    def __init__(self, placements: Sequence[Placement], *, fill_gaps: bool, ignore_gaps: bool) -> None:
        super().__init__(placements, MAX_READ_BITS, GAPS if fill_gaps and placements else _NO_GAPS)
        self._ignored = GAPS if ignore_gaps else _NO_GAPS
        self.image = bytearray(ADDRESSES // 8)
        """Bits by address, the first one in the least significant bit of the first byte."""
        self._variables = {placement.address: placement.variable for placement in placements}
        self._is_repeated = len(set(self._variables.values())) < len(self._variables)

    def read(self, address: int, count: int) -> bytes:
        """`count` bits from `address` on, packed as the protocol sends them, padded with zeros."""
        end = address + count
        covered = int.from_bytes(self.image[address >> 3 : (end + 7) >> 3], "little")
        return (covered >> (address & 7) & ((1 << count) - 1)).to_bytes((count + 7) >> 3, "little")

    def changes(self, address: int, bits: Sequence[bool]) -> list[Change] | Refusal:
        """What writing `bits` from `address` on means for the cell."""
        changes = []
        for position, bit in enumerate(bits, address):
            variable = self._variables.get(position)
            if variable is not None:
                changes.append(Change(variable, bit))
            elif position not in self._ignored:
                return Refusal(Reason.NO_SUCH_ADDRESS)
        if self._is_repeated and (refusal := contradiction(changes)) is not None:
            return refusal
        return changes or Refusal(Reason.NO_SUCH_ADDRESS)

    def usual(self, address: int, count: int) -> Meaning | None:
        """What a write that was accepted is; None if it covers bits with nothing mapped."""
        variables = [self._variables.get(position) for position in range(address, address + count)]
        mapped = tuple(variable for variable in variables if variable is not None)
        if len(mapped) < count:
            return None
        return Meaning(mapped, partial(coils, count=count))

    def ignored(self, address: int, count: int) -> int:
        """Bits that such a write covers without effect."""
        return sum(position not in self._variables for position in range(address, address + count))


class RegisterImage:
    """All four tables of one unit. They follow the cell until `close`, brought up to date when somebody looks."""

    def __init__(self, plan: ModbusPlan, cell: Cell) -> None:
        fill, ignore = plan.fill_gaps, plan.ignore_gaps

        def table(area: Area) -> RegisterTable:
            return RegisterTable(_of(plan.placements, area), cell, fill_gaps=fill, ignore_gaps=ignore)

        def bits(area: Area) -> BitTable:
            return BitTable(_of(plan.placements, area), fill_gaps=fill, ignore_gaps=ignore)

        self._holding = table(Area.HOLDING)
        self._input = table(Area.INPUT)
        self._coils = bits(Area.COIL)
        self._discrete = bits(Area.DISCRETE)
        self._cell = cell
        self._held_back: frozenset[int] = frozenset()
        self._runs = {direction: tuple(self._compile(plan.placements, direction)) for direction in Direction}
        self.changed = set(Direction)
        """Directions of which something has changed since the tables were brought up to date: code that keeps a table
        calls `refresh` before reading, if there are any. The attributes do so by themselves."""
        # A robot sends 500 packages in a second, of which a PLC may read ten: to note a change has to cost nothing.
        self._note = self.changed.add
        cell.listeners.append(self._note)

    @property
    def holding(self) -> RegisterTable:
        """Holding registers."""
        self.refresh()
        return self._holding

    @property
    def input(self) -> RegisterTable:
        """Input registers."""
        self.refresh()
        return self._input

    @property
    def coils(self) -> BitTable:
        """Coils."""
        self.refresh()
        return self._coils

    @property
    def discrete(self) -> BitTable:
        """Discrete inputs."""
        self.refresh()
        return self._discrete

    def readable(self, area: Area) -> Readable:
        """What of an area may be read."""
        tables = {Area.HOLDING: self.holding, Area.INPUT: self.input, Area.COIL: self.coils}
        return tables.get(area, self.discrete).readable

    def close(self) -> None:
        """Follow the cell no longer."""
        if self._note in self._cell.listeners:
            self._cell.listeners.remove(self._note)

    def refresh(self) -> None:
        """Encode what has changed since the last call."""
        if not self.changed:
            return
        values = self._cell.image.values
        for direction in self.changed:
            for run in self._runs[direction]:
                run.refresh(values)
        self.changed.clear()
        if self._cell.unreadable is not self._held_back:
            self._held_back = self._cell.unreadable
            for table in (self._holding, self._input, self._coils, self._discrete):
                table.hold_back(self._held_back)

    def _compile(self, placements: Sequence[Placement], direction: Direction) -> Iterator[Run]:
        variables = self._cell.definition.variables
        flowing = [
            placement for placement in placements if variables[placement.variable].direction is direction
        ]
        for area, words in ((Area.HOLDING, self._holding), (Area.INPUT, self._input)):
            numbers = [placement for placement in _of(flowing, area) if placement.bit is None]
            yield from number_runs(numbers, words.image)
            # A register may mix bits of both directions: each direction then needs all of them to write it whole.
            mixed = {placement.address for placement in _of(flowing, area) if placement.bit is not None}
            packed = [placement for placement in _of(placements, area) if placement.bit is not None]
            yield from words_of_bits([bit for bit in packed if bit.address in mixed], words.image)
        for area, bits in ((Area.COIL, self._coils), (Area.DISCRETE, self._discrete)):
            yield from bit_runs(_of(flowing, area), bits.image)


def _of(placements: Iterable[Placement], area: Area) -> list[Placement]:
    return [placement for placement in placements if placement.area is area]


def _refusal(reason: Reason, item: _Number | _Bits) -> Refusal:
    return Refusal(reason, None if reason is Reason.NO_SUCH_ADDRESS else item.variable)


def _items(placements: Sequence[Placement], cell: Cell, *, ignore_gaps: bool) -> Iterator[_Number | _Bits]:
    variables = cell.definition.variables
    packed: dict[int, list[Placement]] = {}
    for placement in placements:
        if placement.bit is not None:
            packed.setdefault(placement.address, []).append(placement)
        elif placement.codec is not None:
            writable = variables[placement.variable].direction is Direction.INPUT
            yield _Number(placement.address, placement.words, placement.variable, writable, placement.codec)
    for address, parts in packed.items():
        locks = {variables[part.variable].lock for part in parts} - {None}
        # Who writes a register whose inputs are one lock, or that is one part, means it. An output in it nobody means.
        shared = len(locks) > 1
        implied = {part.variable: shared or variables[part.variable].lock is None for part in parts}
        bits = sorted((1 << (part.bit or 0), part.variable) for part in parts if part.codec is None)
        numbers = tuple(
            _Byte(
                0xFF << (part.bit or 0), part.variable, implied[part.variable], part.codec, cell.image.values
            )
            for part in parts
            if part.codec is not None
        )
        mapped = sum({mask for mask, _variable in bits} | {number.mask for number in numbers})
        yield _Bits(
            address,
            writable=bool(locks),
            bits=tuple((mask, variable, implied[variable]) for mask, variable in bits),
            unmapped=0xFFFF & ~mapped,
            ignores_gaps=ignore_gaps,
            numbers=numbers,
        )
