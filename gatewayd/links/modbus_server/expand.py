"""From the Modbus keys of a document to concrete placements, each with its place in the file.

What cannot lie where the file puts it is a placement with a `PlacementProblem`: rules make findings of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.modbus_server.plan import Located
from gatewayd.links.modbus_server.sections import Modbus, ModbusPlaces, PlacementSpec
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Document
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLink, ExpandedVariable
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import TYPES, Codec, make_codec

_BYTES: Final = ("int8", "uint8")
_INTEGERS: Final = ("uint16", "uint32", "uint64", "int16", "int32", "int64")
"""Types that a whole number gets where the file names none: the first that holds the robot's."""


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
    BYTE_TYPE = auto()
    """A byte of another type than int8 and uint8, or one of these in a whole register."""
    SCALE_OF_ZERO = auto()
    BEYOND_END = auto()
    """Addresses after 65535."""


@dataclass(frozen=True, slots=True)
class ExpandedPlacement(Located):
    """Where one variable lies in a Modbus area."""

    variable: ExpandedVariable
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


@dataclass(frozen=True, slots=True)
class ExpandedModbus(ExpandedLink):
    """The places of a cell in the Modbus areas."""

    placements: tuple[ExpandedPlacement, ...]
    """By variable, in file order."""

    @property
    def is_complete(self) -> bool:
        """Whether every variable can lie where the file puts it."""
        return all(placement.problem is None for placement in self.placements)


def placements_of(cell: ExpandedCell) -> tuple[ExpandedPlacement, ...]:
    """The places of a cell in the Modbus areas, by variable."""
    modbus = cell.link(ExpandedModbus)
    return modbus.placements if modbus is not None else ()


def expand_modbus(document: Document, variables: Iterable[ExpandedVariable]) -> ExpandedModbus:
    """Lay the variables out. Never raises."""
    modbus = document.part(Modbus)
    order = modbus.spec.order if modbus is not None else "ABCD"
    lines: dict[str, list[ExpandedVariable]] = {}
    for variable in variables:
        lines.setdefault(variable.part.name, []).append(variable)
    placed = [placement for line in lines.values() for placement in _line(line, order)]
    # Placements were made line by line: several placements of a family lie one family after the other.
    return ExpandedModbus(tuple(sorted(placed, key=lambda placement: placement.variable.index)))


def _line(variables: Sequence[ExpandedVariable], default_order: str) -> Iterator[ExpandedPlacement]:
    part = variables[0].part
    for number, spec in enumerate(part.spec.by(ModbusPlaces).modbus):
        position = part.at("modbus", number, spec.area_key)
        address, bit = spec.address, spec.bit
        for variable in variables:
            placement = _placement(variable, spec, position, (address, bit), default_order)
            yield placement
            if bit is None:
                address += placement.words
            elif spec.is_byte:
                address, bit = address + (bit == 0), 8 - bit
            else:
                address, bit = address + (bit + 1) // 16, (bit + 1) % 16


def _default_type(variable: ExpandedVariable) -> str:
    if variable.low is None or variable.high is None:
        return "bool" if variable.kind is ValueKind.BOOL else "float64"
    low, high = variable.low, variable.high
    return next(name for name in _INTEGERS if TYPES[name].low <= low and high <= TYPES[name].high)


def _placement(
    variable: ExpandedVariable,
    spec: PlacementSpec,
    position: Position,
    place: tuple[int, int | None],
    default_order: str,
) -> ExpandedPlacement:
    address, bit = place
    single = (bit is not None and not spec.is_byte) or spec.area.of_bits
    type_name = spec.type or ("bit" if single else "uint8" if spec.is_byte else _default_type(variable))
    order = _order(spec, type_name, default_order)
    scale = 1.0 if spec.scale is None else spec.scale
    offset = 0.0 if spec.offset is None else spec.offset
    problem = _bit_problem(variable, spec) if single else _number_problem(spec, type_name)
    codec = None
    if not single and problem is None:
        codec = make_codec(
            type_name,
            order,
            kind=variable.kind,
            scale=scale,
            offset=offset,
            low=variable.low,
            high=variable.high,
            limits=variable.spec.limits if variable.direction is Direction.INPUT else None,
        )
    if problem is None and address + (codec.words if codec is not None else 1) > 0x10000:
        problem = PlacementProblem.BEYOND_END
    shown = "bit" if single else type_name
    return ExpandedPlacement(
        variable, spec, position, spec.area, address, bit, shown, order, scale, offset, codec, problem
    )


def _order(spec: PlacementSpec, type_name: str, default: str) -> str:
    """The order of the file is one of words and their bytes: what lies in one register it leaves as it is.

    A `bool` is 0 or 1 whatever is written beside it; numbers of 16 bits can have an order of their own.
    """
    order, number = spec.order or default, TYPES.get(type_name)
    is_own = spec.order is not None and type_name not in ("bool", *_BYTES)
    return order if number is None or number.words > 1 or is_own else _WITHOUT_BYTES.get(order, order)


_WITHOUT_BYTES: Final = {"BADC": "ABCD", "DCBA": "CDAB"}
"""The same order of words, without turning their bytes."""


def _bit_problem(variable: ExpandedVariable, spec: PlacementSpec) -> PlacementProblem | None:
    if variable.kind is not ValueKind.BOOL:
        return PlacementProblem.NUMBER_IN_BIT
    if spec.type not in (None, "bit", "bool"):
        return PlacementProblem.TYPE_IN_BIT
    if spec.scale is not None or spec.offset is not None or spec.order is not None:
        return PlacementProblem.SCALED_BIT
    return None


def _number_problem(spec: PlacementSpec, type_name: str) -> PlacementProblem | None:
    if spec.is_byte != (type_name in _BYTES):
        return PlacementProblem.BYTE_TYPE
    if type_name not in TYPES:
        return PlacementProblem.BIT_WITHOUT_PLACE
    return PlacementProblem.SCALE_OF_ZERO if spec.scale == 0 else None
