"""From the parts of a document to concrete variables, placements and locks, each with its place in the file.

Ranges, vectors and bits become single variables; types, leases and owners become explicit. What cannot be
expanded is kept as `Unresolved` or as a placement with a `PlacementProblem`: rules make findings of them, and
`compile` takes only a mapping without.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.canopen_node.expand import Candidate, CanopenCell, expand_canopen
from gatewayd.links.modbus_server.sections import PlacementSpec
from gatewayd.links.robot.reference import ReferenceProblem, Target, UnresolvedReference, resolve
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.model import ANY, Group, VariableSpec
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import TYPES, Codec, make_codec
from gatewayd.rtde.catalogue import INPUTS, Field
from gatewayd.rtde.types import DataType

__all__ = [
    "SHARED_LEASE",
    "ConcreteLock",
    "ConcretePlacement",
    "ConcreteVariable",
    "ExpandedCell",
    "PlacementProblem",
    "ReferenceProblem",
    "Unresolved",
    "expand",
    "is_program_output",
]

SHARED_LEASE: Final = 5.0
"""Seconds of lease where several writers may own and the file says nothing."""

_RANGES: Final = {
    DataType.UINT8: (0, 0xFF),
    DataType.UINT32: (0, 0xFFFF_FFFF),
    DataType.UINT64: (0, 0xFFFF_FFFF_FFFF_FFFF),
    DataType.INT32: (-0x8000_0000, 0x7FFF_FFFF),
}
_DEFAULT_TYPES: Final = {
    DataType.BOOL: "bool",
    DataType.UINT8: "uint16",
    DataType.UINT32: "uint32",
    DataType.UINT64: "uint64",
    DataType.INT32: "int32",
    DataType.DOUBLE: "float64",
}
_MANY: Final = 2048
"""Some way beyond the limit of variables of a cell."""


class PlacementProblem(Enum):
    """Why a variable cannot lie where the file puts it."""

    NUMBER_IN_BIT = auto()
    """A number in a coil, discrete input or single bit of a register."""
    BIT_WITHOUT_PLACE = auto()
    """Type `bit` at a whole register."""
    TYPE_IN_BIT = auto()
    """A number type for a coil, discrete input or single bit."""
    SCALED_BIT = auto()
    """Scale, offset or order for a single bit."""
    SCALE_OF_ZERO = auto()
    BEYOND_END = auto()
    """Addresses after 65535."""


@dataclass(frozen=True, slots=True)
class Unresolved:
    """A variable whose robot reference names nothing known."""

    part: Part[VariableSpec]
    problem: ReferenceProblem
    name: str
    """The field, or the first register that does not exist."""
    limit: int | None = None
    """Elements or bits that there are, or the greatest register number."""


@dataclass(frozen=True, slots=True)
class ConcreteVariable:
    """One variable after expansion."""

    index: int
    """Position in `ExpandedCell.variables`; the number that people see is one more."""
    name: str
    part: Part[VariableSpec]
    """The line it comes from."""
    direction: Direction
    target: str
    """What it is in the robot, in full: `input_bit_register_5`, `actual_TCP_pose[0]`, `runtime_state`."""
    field: Field
    """Catalogue entry of the field that carries it."""
    type: DataType
    """Robot type of the one value: BOOL for a bit, the element type for a vector."""
    kind: ValueKind
    bit: int | None
    element: int | None
    member: int | None
    """Index within the family of its line (`recipe[3]`: 3); None for a single variable."""
    lock: int | None
    """Index into `ExpandedCell.locks`; None for outputs and where the group does not exist."""
    valid_running: bool
    """Whether it is good only while the robot program runs."""

    @property
    def spec(self) -> VariableSpec:
        """The line it comes from, typed."""
        return self.part.spec

    @property
    def low(self) -> int | None:
        """Least value of the robot's type; None for bits and reals."""
        return _RANGES[self.type][0] if self.kind is ValueKind.INT else None

    @property
    def high(self) -> int | None:
        """Greatest value of the robot's type; None for bits and reals."""
        return _RANGES[self.type][1] if self.kind is ValueKind.INT else None

    @property
    def position(self) -> Position:
        """Place of the variable's name."""
        return self.part.key

    def at(self, *path: str | int) -> Position:
        """Place of a value of its line."""
        return self.part.at(*path)


@dataclass(frozen=True, slots=True)
class ConcretePlacement:
    """Where one variable lies in a Modbus area."""

    variable: ConcreteVariable
    spec: PlacementSpec
    position: Position
    """Place of the address in the file."""
    area: Area
    address: int
    bit: int | None
    """Bit of the register, for packed bits."""
    type: str
    """Number type; `bit` for packed bits, coils and discrete inputs."""
    order: str
    scale: float
    offset: float
    codec: Codec | None
    """None for single bits and where `problem` is set."""
    problem: PlacementProblem | None = None

    @property
    def words(self) -> int:
        """Addresses covered: registers, or 1 for a coil, a discrete input or a packed bit."""
        return self.codec.words if self.codec is not None else 1

    @property
    def addresses(self) -> range:
        """Addresses covered."""
        return range(self.address, self.address + self.words)

    @property
    def notation(self) -> str:
        """The 4xxxxx form, with the bit where there is one: `400001.3`."""
        return self.area.notation(self.address) + ("" if self.bit is None else f".{self.bit}")

    @property
    def place(self) -> str:
        """The address as the file counts: `100` or `100.3`."""
        return str(self.address) if self.bit is None else f"{self.address}.{self.bit}"


@dataclass(frozen=True, slots=True)
class ConcreteLock:
    """What is owned together: one input variable or one group."""

    name: str
    members: tuple[int, ...]
    """Indices of variables."""
    owners: tuple[str, ...]
    """Writers by priority, `any` resolved; unknown names are left out."""
    is_any: bool
    takeover: bool
    lease: float | None
    whole: bool
    group: Part[Group] | None
    position: Position
    """Place of the owner, or of what declares the lock."""


@dataclass(frozen=True, slots=True)
class ExpandedCell:
    """A document, expanded."""

    document: Document
    variables: tuple[ConcreteVariable, ...]
    placements: tuple[ConcretePlacement, ...]
    """By variable, in file order."""
    locks: tuple[ConcreteLock, ...]
    """By first variable."""
    unresolved: tuple[Unresolved, ...]
    canopen: CanopenCell | None = None

    @property
    def is_complete(self) -> bool:
        """Whether everything in it could be expanded."""
        return (
            not self.unresolved
            and all(placement.problem is None for placement in self.placements)
            and (self.canopen is None or self.canopen.is_complete)
        )


def is_program_output(field: Field) -> bool:
    """Whether it is an output register, which only the robot program writes."""
    return field.name.startswith("output_")


def expand(document: Document) -> ExpandedCell:
    """Expand the variables of a document. Never raises, whatever valid parts it holds.

    Stops some way beyond the limit of variables, so that no file can fill the memory with them.
    """
    builder = _Builder(document)
    for part in document.variables.values():
        if len(builder.variables) > _MANY:
            break
        builder.add(part)
    return builder.finished()


class _Builder:
    def __init__(self, document: Document) -> None:
        self.document = document
        self.variables: list[ConcreteVariable] = []
        self.placements: list[ConcretePlacement] = []
        self.unresolved: list[Unresolved] = []
        self._members: list[list[int]] = []
        self._group_locks: dict[str, int] = {}

    def add(self, part: Part[VariableSpec]) -> None:
        try:
            targets = resolve(part.spec.robot)
        except UnresolvedReference as error:
            self.unresolved.append(Unresolved(part, error.problem, error.name, error.limit))
            return
        family = part.spec.robot.many or len(targets) > 1
        created = [
            self._variable(part, target, member if family else None) for member, target in enumerate(targets)
        ]
        for number, spec in enumerate(part.spec.modbus):
            self._place(created, spec, part.at("modbus", number, spec.area_key))

    def finished(self) -> ExpandedCell:
        # Placements were made line by line: several placements of a family lie one family after the other.
        placements = sorted(self.placements, key=lambda placement: placement.variable.index)
        return ExpandedCell(
            self.document,
            tuple(self.variables),
            tuple(placements),
            tuple(self._lock(index) for index in range(len(self._members))),
            tuple(self.unresolved),
            self._canopen(),
        )

    def _canopen(self) -> CanopenCell | None:
        part = self.document.canopen
        if part is None:
            return None
        candidates = [
            Candidate(
                variable.index,
                variable.part.name,
                variable.name,
                variable.member,
                variable.direction,
                variable.type,
                variable.kind,
                variable.spec.canopen,
            )
            for variable in self.variables
        ]
        return expand_canopen(part, candidates)

    def _variable(self, part: Part[VariableSpec], target: Target, member: int | None) -> ConcreteVariable:
        name = part.name if member is None else f"{part.name}[{member}]"
        direction = Direction.INPUT if target.field.name in INPUTS else Direction.OUTPUT
        index = len(self.variables)
        lock = self._lock_index(part, index) if direction is Direction.INPUT else None
        variable = ConcreteVariable(
            index,
            name,
            part,
            direction,
            target.name,
            target.field,
            target.type,
            _kind(target.type),
            target.bit,
            target.element,
            member,
            lock,
            direction is Direction.OUTPUT and self._is_valid_running(part, target),
        )
        self.variables.append(variable)
        return variable

    def _is_valid_running(self, part: Part[VariableSpec], target: Target) -> bool:
        robot = self.document.robot
        of_all = robot is not None and robot.spec.valid is not None and is_program_output(target.field)
        return of_all or part.spec.valid is not None

    def _lock_index(self, part: Part[VariableSpec], index: int) -> int | None:
        group = part.spec.group
        if group is None:
            self._members.append([index])
            return len(self._members) - 1
        if group not in self.document.groups:
            return None
        if group not in self._group_locks:
            self._group_locks[group] = len(self._members)
            self._members.append([])
        lock = self._group_locks[group]
        self._members[lock].append(index)
        return lock

    def _lock(self, index: int) -> ConcreteLock:
        members = tuple(self._members[index])
        line = self.variables[members[0]].part
        group = self.document.groups[line.spec.group] if line.spec.group is not None else None
        declared: Part[Group] | Part[VariableSpec] = group if group is not None else line
        spec = declared.spec
        names = spec.owner or (ANY,)
        is_any = names == (ANY,)
        writers = self.document.writers
        owners = tuple(writers) if is_any else tuple(dict.fromkeys(name for name in names if name in writers))
        shared = is_any or len(names) > 1
        lease = spec.lease if "lease" in spec.model_fields_set else SHARED_LEASE if shared else None
        takeover = spec.takeover if spec.takeover is not None else shared and not is_any
        name = group.name if group is not None else self.variables[members[0]].name
        position = declared.at("owner") if spec.owner is not None else declared.key
        whole = group is not None and group.spec.whole
        return ConcreteLock(name, members, owners, is_any, takeover, lease, whole, group, position)

    def _place(self, variables: list[ConcreteVariable], spec: PlacementSpec, position: Position) -> None:
        modbus = self.document.modbus
        default_order = modbus.spec.order if modbus is not None else "ABCD"
        address, bit = spec.address, spec.bit
        for variable in variables:
            placement = _placement(variable, spec, position, (address, bit), default_order)
            self.placements.append(placement)
            if bit is None:
                address += placement.words
            else:
                address, bit = address + (bit + 1) // 16, (bit + 1) % 16


def _placement(
    variable: ConcreteVariable,
    spec: PlacementSpec,
    position: Position,
    place: tuple[int, int | None],
    default_order: str,
) -> ConcretePlacement:
    address, bit = place
    single = bit is not None or spec.area.of_bits
    type_name = spec.type or ("bit" if single else _DEFAULT_TYPES[variable.type])
    order, scale, offset = spec.order or default_order, spec.scale, spec.offset
    problem = _bit_problem(variable, spec) if single else _number_problem(spec, type_name)
    codec = None
    if not single and problem is None:
        codec = make_codec(
            type_name,
            order,
            kind=variable.kind,
            scale=1.0 if scale is None else scale,
            offset=0.0 if offset is None else offset,
            low=variable.low,
            high=variable.high,
        )
    if problem is None and address + (codec.words if codec is not None else 1) > 0x10000:
        problem = PlacementProblem.BEYOND_END
    return ConcretePlacement(
        variable,
        spec,
        position,
        spec.area,
        address,
        bit,
        "bit" if single else type_name,
        order,
        1.0 if scale is None else scale,
        0.0 if offset is None else offset,
        codec,
        problem,
    )


def _bit_problem(variable: ConcreteVariable, spec: PlacementSpec) -> PlacementProblem | None:
    if variable.kind is not ValueKind.BOOL:
        return PlacementProblem.NUMBER_IN_BIT
    if spec.type not in (None, "bit", "bool"):
        return PlacementProblem.TYPE_IN_BIT
    if spec.scale is not None or spec.offset is not None or spec.order is not None:
        return PlacementProblem.SCALED_BIT
    return None


def _number_problem(spec: PlacementSpec, type_name: str) -> PlacementProblem | None:
    if type_name not in TYPES:
        return PlacementProblem.BIT_WITHOUT_PLACE
    return PlacementProblem.SCALE_OF_ZERO if spec.scale == 0 else None


def _kind(data_type: DataType) -> ValueKind:
    if data_type is DataType.BOOL:
        return ValueKind.BOOL
    return ValueKind.INT if data_type in _RANGES else ValueKind.FLOAT
