"""From the CANopen part of a document to concrete objects and PDOs, each with its place in the file.

What cannot be laid out is kept for the rules to find (`CanopenCell.is_complete`); `compile` takes only a node without.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.canopen_node.pdo_layout import (
    PDO_BITS,
    PDO_NUMBERS,
    Slot,
    assign,
    place_objects,
    split_into_pdos,
)
from gatewayd.links.canopen_node.plan import ObjectPlan
from gatewayd.links.canopen_node.sections import AUTO, NO_PDO, Canopen, CanopenPlace, PdoDefaults, PdoSpec
from gatewayd.links.canopen_node.status_words import StatusWord, field_word, quality_word
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Part
from gatewayd.rtde.types import DataType

__all__ = [
    "Candidate",
    "CanopenCell",
    "ConcretePdo",
    "MappedObject",
    "MemberProblem",
    "Misnamed",
    "default_type",
    "expand_canopen",
]

_DEFAULT_TYPES: Final = {
    DataType.BOOL: CanType.BOOLEAN,
    DataType.UINT8: CanType.UNSIGNED8,
    DataType.UINT32: CanType.UNSIGNED32,
    DataType.UINT64: CanType.UNSIGNED64,
    DataType.INT32: CanType.INTEGER32,
}
_MANY: Final = 2048
"""So many variables that a PDO does not get are enough to be told."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A variable as the layout sees it."""

    index: int
    """Position among the variables of the cell."""
    line: str
    """Name of its line."""
    name: str
    """Its own: `start`, `recipe[3]`."""
    member: int | None
    """Index within the family of its line; None for a single variable."""
    direction: Direction
    type: DataType
    kind: ValueKind
    place: CanopenPlace | None
    """What its line says of CANopen."""


@dataclass(frozen=True, slots=True)
class MappedObject:
    """A variable in the object dictionary."""

    plan: ObjectPlan
    direction: Direction
    fits: bool
    """The type of the file suits the robot's; else the default type stands in for it."""

    @property
    def variable(self) -> int:
        """Index of the variable."""
        return self.plan.variable


@dataclass(frozen=True, slots=True)
class ConcretePdo:
    """One PDO: what it is called on the bus, what it carries and when."""

    name: str
    """As the file calls it; empty for one of the automatic layout."""
    position: Position
    """Place of its name, or of the first variable that asks for it."""
    direction: Direction
    """From the robot where it carries status words; else that of its first variable."""
    slot: Slot
    transmission: int
    inhibit: float | None
    """Seconds."""
    event: float | None
    """Seconds: event timer, or deadline towards the robot."""
    sync_start: int
    entries: tuple[MappedObject, ...]
    """Variables, in their order."""
    status: tuple[StatusWord, ...] = ()
    """Words of the status block, which come before the variables."""

    @property
    def label(self) -> str:
        """What people call it: `TPDO 3`, or with its name `TPDO 3 (force)`."""
        kind = "TPDO" if self.direction is Direction.OUTPUT else "RPDO"
        return f"{kind} {self.slot.number}" + (f" ({self.name})" if self.name else "")

    @property
    def bits(self) -> int:
        """Bits that are mapped."""
        return self._status_bits + sum(entry.plan.type.bits for entry in self.entries)

    @property
    def _status_bits(self) -> int:
        return sum(word.type.bits for word in self.status)

    @property
    def status_offsets(self) -> Iterator[tuple[int, StatusWord]]:
        """Each word of the status block with the bit where it begins."""
        offset = 0
        for word in self.status:
            yield offset, word
            offset += word.type.bits

    @property
    def offsets(self) -> Iterator[tuple[int, MappedObject]]:
        """Each variable with the bit where it begins."""
        offset = self._status_bits
        for entry in self.entries:
            yield offset, entry
            offset += entry.plan.type.bits


class MemberProblem(Enum):
    """Why a variable that a PDO names is not in it."""

    UNKNOWN = auto()
    """There is no such line, or its family has no such member."""
    TAKEN = auto()
    """It is in another PDO, or in this one already."""
    OBJECT_ONLY = auto()
    """Its own line keeps it out of PDOs."""


@dataclass(frozen=True, slots=True)
class Misnamed:
    """A variable that a PDO names and does not get."""

    pdo: str
    text: str
    """As the PDO names it."""
    problem: MemberProblem
    position: Position | None
    """Where the PDO names it; None where the line of the variable asks for the PDO."""
    variable: int | None = None
    other: str = ""
    """PDO that has it."""


@dataclass(frozen=True, slots=True)
class CanopenCell:
    """One node, expanded."""

    part: Part[Canopen]
    objects: tuple[MappedObject, ...]
    """By variable."""
    pdos: tuple[ConcretePdo, ...]
    """RPDOs, then TPDOs, each by number."""
    empty: tuple[str, ...]
    """PDOs of the file that carry nothing."""
    misnamed: tuple[Misnamed, ...]

    @property
    def is_complete(self) -> bool:
        """Whether everything in it could be laid out."""
        return (
            not self.empty
            and not self.misnamed
            and all(one.fits for one in self.objects)
            and all(_is_whole(pdo) for pdo in self.pdos)
        )


def _is_whole(pdo: ConcretePdo) -> bool:
    return (
        pdo.slot.cob_id is not None
        and pdo.slot.number <= PDO_NUMBERS
        and pdo.bits <= PDO_BITS
        and all(entry.direction is pdo.direction for entry in pdo.entries)
    )


def default_type(data_type: DataType, real: str) -> CanType:
    """The type of a variable that names none; `real` is the type of reals."""
    return _DEFAULT_TYPES[data_type] if data_type in _DEFAULT_TYPES else CanType[real]


def expand_canopen(part: Part[Canopen], candidates: Sequence[Candidate]) -> CanopenCell:
    """Lay the node out. Never raises."""
    layout = _Layout(part, candidates)
    layout.name_members()
    layout.place()
    return layout.finished()


class _Layout:
    def __init__(self, part: Part[Canopen], candidates: Sequence[Candidate]) -> None:
        self.part = part
        self.candidates = candidates
        self._lines: dict[str, list[Candidate]] = {}
        for candidate in candidates:
            self._lines.setdefault(candidate.line, []).append(candidate)
        self._misnamed: list[Misnamed] = []
        self._of: dict[int, str] = {}
        """Variable -> the PDO that it is in."""
        self._members: dict[str, list[int]] = {name: [] for name in part.spec.pdos}
        self._status: dict[str, list[StatusWord]] = {name: [] for name in part.spec.pdos}
        self._objects: dict[int, MappedObject] = {}

    def name_members(self) -> None:
        """Collect the variables of the PDOs of the file: those they list, then those that ask for them."""
        for name, pdo in self.part.spec.pdos.items():
            self._name_status(name, pdo)
            for number, member in enumerate(pdo.variables):
                position = self.part.at("pdos", name, "variables", number)
                if len(self._misnamed) > _MANY:
                    break
                found = self._find(member.name, member.members)
                if found is None:
                    self._misnamed.append(Misnamed(name, member.text, MemberProblem.UNKNOWN, position))
                    continue
                for candidate in found:
                    self._enter(name, member.text, candidate, position)
        for candidate in self.candidates:
            wanted = candidate.place.pdo if candidate.place is not None else NO_PDO
            if wanted in self._members and self._of.get(candidate.index) != wanted:
                self._enter(wanted, candidate.line, candidate, None)

    def _name_status(self, name: str, pdo: PdoSpec) -> None:
        for number, member in enumerate(pdo.status):
            if member.variables is None:
                self._status[name].append(field_word(member.field))
                continue
            found = self._find(member.variables.name, member.variables.members)
            if found is None:
                position = self.part.at("pdos", name, "status", number)
                self._misnamed.append(Misnamed(name, member.variables.text, MemberProblem.UNKNOWN, position))
            else:
                self._status[name] += (quality_word(one.index, one.name) for one in found)

    def _find(self, name: str, members: range | None) -> list[Candidate] | None:
        family = self._lines.get(name)
        if family is None or members is None:
            return family
        if len(members) > len(family):
            return None
        by_member = {candidate.member: candidate for candidate in family}
        found = [by_member[number] for number in members if number in by_member]
        return found if len(found) == len(members) else None

    def _enter(self, pdo: str, text: str, candidate: Candidate, position: Position | None) -> None:
        index, other = candidate.index, self._of.get(candidate.index)
        place = candidate.place
        if other is not None:
            self._misnamed.append(Misnamed(pdo, text, MemberProblem.TAKEN, position, index, other))
        elif place is not None and place.pdo == NO_PDO:
            self._misnamed.append(Misnamed(pdo, text, MemberProblem.OBJECT_ONLY, position, index))
        else:
            self._of[index] = pdo
            self._members[pdo].append(index)

    def place(self) -> None:
        """Give every variable that is on CANopen its object."""
        real = self.part.spec.pdo.real
        chosen: list[tuple[Candidate, CanType, bool]] = []
        for candidate in self.candidates:
            if candidate.place is None and candidate.index not in self._of:
                continue
            plain = default_type(candidate.type, real)
            named = candidate.place.type if candidate.place is not None else None
            can_type = CanType[named] if named is not None else plain
            fits = _fits(candidate.kind, can_type)
            chosen.append((candidate, can_type if fits else plain, fits))
        placed = place_objects((one.index, one.direction, can_type) for one, can_type, _ in chosen)
        for (candidate, _, fits), plan in zip(chosen, placed, strict=True):
            self._objects[candidate.index] = MappedObject(plan, candidate.direction, fits)

    def finished(self) -> CanopenCell:
        """The whole node."""
        pdos = [pdo for direction in Direction for pdo in self._direction(direction)]
        return CanopenCell(
            self.part,
            tuple(self._objects.values()),
            tuple(pdos),
            tuple(name for name, members in self._members.items() if not members and not self._status[name]),
            tuple(self._misnamed),
        )

    def _direction(self, direction: Direction) -> list[ConcretePdo]:
        named = [
            (name, tuple(self._objects[index] for index in self._members[name]))
            for name in self._members
            if self._direction_of(name) is direction
        ]
        automatic = [
            self._objects[one.index].plan
            for one in self.candidates
            if one.direction is direction and one.place is not None and one.place.pdo == AUTO
            if one.index not in self._of
        ]
        contents: list[tuple[str, tuple[MappedObject, ...]]] = [
            *named,
            *(
                ("", tuple(self._objects[plan.variable] for plan in pdo))
                for pdo in split_into_pdos(automatic)
            ),
        ]
        specs = self.part.spec.pdos
        pool = self.part.spec.cob_ids
        transmit = direction is Direction.OUTPUT
        slots = assign(
            [specs[name].cob_id if name else None for name, _ in contents],
            self.part.spec.node,
            _flat(pool.tpdo if transmit else pool.rpdo),
            transmit=transmit,
        )
        made = [
            self._pdo(name, direction, slot, entries)
            for (name, entries), slot in zip(contents, slots, strict=True)
        ]
        return sorted(made, key=lambda pdo: pdo.slot.number)

    def _direction_of(self, name: str) -> Direction | None:
        """Which way a PDO of the file goes; None for an empty one."""
        if self._status[name]:
            return Direction.OUTPUT
        members = self._members[name]
        return self.candidates[members[0]].direction if members else None

    def _pdo(
        self, name: str, direction: Direction, slot: Slot, entries: tuple[MappedObject, ...]
    ) -> ConcretePdo:
        defaults = self.part.spec.pdo
        spec: PdoSpec | PdoDefaults = self.part.spec.pdos[name] if name else defaults
        timer = "event" if direction is Direction.OUTPUT else "deadline"
        position = self.part.key_at("pdos", name) if name else self.part.key
        return ConcretePdo(
            name,
            position,
            direction,
            slot,
            defaults.transmission if spec.transmission is None else spec.transmission,
            _given(spec, defaults, "inhibit"),
            _given(spec, defaults, timer),
            spec.sync_start if isinstance(spec, PdoSpec) else 0,
            entries,
            tuple(self._status[name]) if name else (),
        )


def _given(spec: PdoSpec | PdoDefaults, defaults: PdoDefaults, key: str) -> float | None:
    """A time of a PDO where it is written (`none` counts), else the default of all."""
    value: float | None = getattr(spec if key in spec.model_fields_set else defaults, key)
    return value


def _flat(ranges: Iterable[range]) -> Iterator[int]:
    return (cob_id for one in ranges for cob_id in one)


def _fits(kind: ValueKind, can_type: CanType) -> bool:
    if kind is ValueKind.BOOL:
        return can_type is CanType.BOOLEAN
    if kind is ValueKind.FLOAT:
        return can_type.is_real
    return can_type is not CanType.BOOLEAN and not can_type.is_real
