"""From the CANopen part of a document to concrete objects and PDOs, each with its place in the file.

What cannot be laid out is kept for the rules to find (`CanopenCell.is_complete`); `compile` takes only a node without.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto
from itertools import chain
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
from gatewayd.links.canopen_node.sections import (
    AUTO,
    NO_PDO,
    Canopen,
    CanopenPlace,
    CanopenPlaces,
    CanopenWriter,
    PdoDefaults,
    PdoSpec,
)
from gatewayd.links.canopen_node.status_words import StatusWord, field_word, quality_word
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLink, ExpandedVariable

_INTEGERS: Final = (
    CanType.UNSIGNED8,
    CanType.UNSIGNED16,
    CanType.UNSIGNED32,
    CanType.UNSIGNED64,
    CanType.INTEGER8,
    CanType.INTEGER16,
    CanType.INTEGER32,
    CanType.INTEGER64,
)
"""Types that a whole number gets where the file names none: the first that holds the robot's."""
_MANY: Final = 2048
"""So many variables that a PDO does not get are enough to be reported."""


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
class ExpandedPdo:
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
    def is_whole(self) -> bool:
        """Whether it has a number and a COB-ID, and all of it goes into one frame and one direction."""
        return (
            self.slot.cob_id is not None
            and self.slot.number <= PDO_NUMBERS
            and self.bits <= PDO_BITS
            and all(entry.direction is self.direction for entry in self.entries)
        )

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
class CanopenCell(ExpandedLink):
    """One node, expanded."""

    part: Part[Canopen]
    objects: tuple[MappedObject, ...]
    """By variable."""
    pdos: tuple[ExpandedPdo, ...]
    """RPDOs, then TPDOs, each by number."""
    empty: tuple[str, ...]
    """PDOs of the file that carry nothing."""
    misnamed: tuple[Misnamed, ...]

    @property
    def carried(self) -> frozenset[int]:
        """Indices of the variables that PDOs carry."""
        return frozenset(entry.variable for pdo in self.pdos for entry in pdo.entries)

    @property
    def is_complete(self) -> bool:
        """Whether everything in it could be laid out."""
        return (
            not self.empty
            and not self.misnamed
            and all(placed.fits for placed in self.objects)
            and all(pdo.is_whole for pdo in self.pdos)
        )


def node_of(cell: ExpandedCell) -> CanopenCell | None:
    """The node of a cell; None where it has none."""
    return cell.link(CanopenCell)


def the_node(cell: ExpandedCell) -> CanopenCell:
    """The node of a cell that has one."""
    node = node_of(cell)
    assert node is not None
    return node


def default_type(variable: ExpandedVariable, real: str) -> CanType:
    """The type of a variable that names none; `real` is the type of reals."""
    if variable.low is None or variable.high is None:
        return CanType.BOOLEAN if variable.kind is ValueKind.BOOL else CanType[real]
    low, high = variable.low, variable.high
    return next(integer for integer in _INTEGERS if integer.bounds[0] <= low and high <= integer.bounds[1])


def place_of(variable: ExpandedVariable) -> CanopenPlace | None:
    """What the line of a variable says of CANopen."""
    return variable.spec.by(CanopenPlaces).canopen


def writes_by(writer: CanopenWriter, pdo: ExpandedPdo, cell: ExpandedCell) -> bool:
    """Whether a PDO towards the robot is this writer's: it names it, or nobody does and it names none."""
    if not writer.by_rpdo:
        return False
    if writer.pdos:
        return pdo.name in writer.pdos
    return not any(pdo.name in part.spec.by(CanopenWriter).pdos for part in cell.document.writers.values())


Linear = tuple[float, float]
"""Scale and offset."""


def linear_of(place: CanopenPlace | None) -> Linear | None:
    """Scale and offset that a line declares; None where it declares none, or none that does anything."""
    if place is None:
        return None
    linear = (1.0 if place.scale is None else place.scale, place.offset or 0.0)
    return None if linear == (1.0, 0.0) and place.scale is None else linear


def scale_problem(variable: ExpandedVariable, linear: Linear | None) -> str | None:
    """Why a scale cannot be: it cannot be undone, or there is nothing to scale."""
    if linear is None:
        return None
    if variable.kind is ValueKind.BOOL:
        return "is a bit and has a scale or offset"
    return "has the scale 0" if linear[0] == 0 else None


def expand_canopen(part: Part[Canopen], variables: Sequence[ExpandedVariable]) -> CanopenCell:
    """Lay the node out. Never raises."""
    return _Layout(part, variables).finished()


class _Layout:
    def __init__(self, part: Part[Canopen], variables: Sequence[ExpandedVariable]) -> None:
        self.part = part
        self.variables = variables
        self._lines: dict[str, list[ExpandedVariable]] = {}
        for variable in variables:
            self._lines.setdefault(variable.part.name, []).append(variable)
        self._misnamed: list[Misnamed] = []
        self._of: dict[int, str] = {}
        """Variable -> the PDO that it is in."""
        self._members: dict[str, list[int]] = {name: [] for name in part.spec.pdos}
        self._status: dict[str, list[StatusWord]] = {name: [] for name in part.spec.pdos}
        self._name_members()
        self._objects = self._placed()

    def _name_members(self) -> None:
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
                for variable in found:
                    self._enter(name, member.text, variable, position)
        for variable in self.variables:
            place = place_of(variable)
            wanted = place.pdo if place is not None else NO_PDO
            if wanted in self._members and self._of.get(variable.index) != wanted:
                self._enter(wanted, variable.part.name, variable, None)

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
                self._status[name] += (quality_word(variable.index, variable.name) for variable in found)

    def _find(self, name: str, members: range | None) -> list[ExpandedVariable] | None:
        family = self._lines.get(name)
        if family is None or members is None:
            return family
        if len(members) > len(family):
            return None
        by_member = {variable.member: variable for variable in family}
        found = [by_member[number] for number in members if number in by_member]
        return found if len(found) == len(members) else None

    def _enter(self, pdo: str, text: str, variable: ExpandedVariable, position: Position | None) -> None:
        index, other = variable.index, self._of.get(variable.index)
        place = place_of(variable)
        if other is not None:
            self._misnamed.append(Misnamed(pdo, text, MemberProblem.TAKEN, position, index, other))
        elif place is not None and place.pdo == NO_PDO:
            self._misnamed.append(Misnamed(pdo, text, MemberProblem.OBJECT_ONLY, position, index))
        else:
            self._of[index] = pdo
            self._members[pdo].append(index)

    def _placed(self) -> dict[int, MappedObject]:
        """The object of every variable that is on CANopen."""
        real = self.part.spec.pdo.real
        chosen: list[tuple[ExpandedVariable, CanType, Linear | None, bool]] = []
        for variable in self.variables:
            place = place_of(variable)
            if place is None and variable.index not in self._of:
                continue
            plain = default_type(variable, real)
            named = place.type if place is not None else None
            can_type = CanType[named] if named is not None else plain
            linear = linear_of(place)
            fits = _fits(variable.kind, can_type, linear) and scale_problem(variable, linear) is None
            chosen.append((variable, can_type if fits else plain, linear if fits else None, fits))
        plans = place_objects(
            (variable.index, variable.direction, can_type) for variable, can_type, _, _ in chosen
        )
        return {
            variable.index: MappedObject(replace(plan, linear=linear), variable.direction, fits)
            for (variable, _, linear, fits), plan in zip(chosen, plans, strict=True)
        }

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

    def _direction(self, direction: Direction) -> list[ExpandedPdo]:
        named = [name for name in self._members if self._direction_of(name) is direction]
        automatic = [
            self._objects[variable.index].plan
            for variable in self.variables
            if variable.direction is direction and variable.index not in self._of
            if (place := place_of(variable)) is not None and place.pdo == AUTO
        ]
        contents = [(name, self._members[name]) for name in named]
        contents += [("", [plan.variable for plan in pdo]) for pdo in split_into_pdos(automatic)]
        specs = self.part.spec.pdos
        pool = self.part.spec.cob_ids
        transmit = direction is Direction.OUTPUT
        slots = assign(
            [specs[name].cob_id if name else None for name, _ in contents],
            self.part.spec.node,
            chain.from_iterable(pool.tpdo if transmit else pool.rpdo),
            transmit=transmit,
        )
        made = [
            self._pdo(name, direction, slot, tuple(self._objects[index] for index in members))
            for (name, members), slot in zip(contents, slots, strict=True)
        ]
        return sorted(made, key=lambda pdo: pdo.slot.number)

    def _direction_of(self, name: str) -> Direction | None:
        """Which way a PDO of the file goes; None for an empty one."""
        if self._status[name]:
            return Direction.OUTPUT
        members = self._members[name]
        return self.variables[members[0]].direction if members else None

    def _pdo(
        self, name: str, direction: Direction, slot: Slot, entries: tuple[MappedObject, ...]
    ) -> ExpandedPdo:
        defaults = self.part.spec.pdo
        spec: PdoSpec | PdoDefaults = self.part.spec.pdos[name] if name else defaults
        timer = "event" if direction is Direction.OUTPUT else "deadline"
        position = self.part.key_at("pdos", name) if name else self.part.key
        return ExpandedPdo(
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


def _fits(kind: ValueKind, can_type: CanType, linear: Linear | None) -> bool:
    if kind is ValueKind.BOOL:
        return can_type is CanType.BOOLEAN
    if kind is ValueKind.FLOAT:
        return can_type.is_real or (linear is not None and can_type is not CanType.BOOLEAN)
    return can_type is not CanType.BOOLEAN and not can_type.is_real
