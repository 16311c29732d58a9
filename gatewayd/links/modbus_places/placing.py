"""From a place as the file has it to one with everything worked out: type, order, codec, and what is wrong with it.

What cannot lie where the file puts it is a placement with a `PlacementProblem`: rules make findings of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.modbus_places.located import Located
from gatewayd.links.modbus_places.sections import RegisterSpec
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Step
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLink, ExpandedVariable
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import TYPES, Codec, make_codec

_BYTES: Final = ("int8", "uint8")
_INTEGERS: Final = ("uint16", "uint32", "uint64", "int16", "int32", "int64")
"""Types that a whole number gets where the file names none: the first that holds the robot's."""
FIELD_TYPE: Final = "uint16"
"""What a number in several bits of a register is read as, once its bits are cut out."""


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
    TYPE_OF_BITS = auto()
    """A type or an order for several bits of a register: they are a number without a sign."""


@dataclass(frozen=True, slots=True)
class ExpandedPlacement(Located):
    """Where one variable lies in a Modbus area."""

    variable: ExpandedVariable
    spec: RegisterSpec
    path: tuple[Step, ...]
    """Steps from the variable's line to the place in the file."""
    area: Area
    address: int
    bit: int | None
    """Bit of the register, for packed bits; the lowest one of a byte or of several bits."""
    type: str
    """Number type; `bit` for packed bits, coils and discrete inputs."""
    order: str
    scale: float
    offset: float
    codec: Codec | None
    """None for single bits and where `problem` is set."""
    problem: PlacementProblem | None = None
    width: int = 0
    """Bits of a number that has several bits of a register; else 0."""

    @property
    def position(self) -> Position:
        """Place of the address in the file."""
        return self.variable.at(*self.path, self.spec.area_key)

    @property
    def ends(self) -> tuple[float, float]:
        """Least and greatest raw number of a place with a codec."""
        number = TYPES[self.type]
        return (0, (1 << self.width) - 1) if self.width else (number.low, number.high)

    def key_position(self, key: str) -> Position:
        """Place of one of its keys where that was written, else of its address."""
        return self.position if getattr(self.spec, key) is None else self.variable.at(*self.path, key)


@dataclass(frozen=True, slots=True)
class ExpandedPlaces(ExpandedLink):
    """The places of a cell in the Modbus areas by one kind of link."""

    placements: tuple[ExpandedPlacement, ...]
    """By variable, in file order."""

    @property
    def is_complete(self) -> bool:
        """Whether every variable can lie where the file puts it."""
        return all(placement.problem is None for placement in self.placements)


def all_placements(cell: ExpandedCell) -> Iterator[ExpandedPlacement]:
    """The places of a cell in Modbus areas by all kinds of links, for rules that hold for each of them."""
    for link in cell.links.values():
        if isinstance(link, ExpandedPlaces):
            yield from link.placements


def place_line(
    variables: Sequence[ExpandedVariable],
    spec: RegisterSpec,
    path: tuple[Step, ...],
    default_order: str,
    bits: range | None = None,
) -> Iterator[ExpandedPlacement]:
    """Lay the variables of one line out one after the other, from the place in the file at `path` on.

    `bits`: those of a register that a number has, where it has several; the next one has the next register.
    """
    address, bit = spec.address, spec.bit if bits is None else bits.start
    for variable in variables:
        width = 0 if bits is None else len(bits)
        placement = _placement(variable, spec, path, (address, bit), default_order, width=width)
        yield placement
        if bit is None or bits is not None:
            address += placement.words
        elif spec.is_byte:
            address, bit = address + (bit == 0), 8 - bit
        else:
            address, bit = address + (bit + 1) // 16, (bit + 1) % 16


def _usual_type(variable: ExpandedVariable, spec: RegisterSpec, *, single: bool) -> str:
    return "bit" if single else "uint8" if spec.is_byte else _default_type(variable)


def _default_type(variable: ExpandedVariable) -> str:
    if variable.low is None or variable.high is None:
        return "bool" if variable.kind is ValueKind.BOOL else "float64"
    low, high = variable.low, variable.high
    return next(name for name in _INTEGERS if TYPES[name].low <= low and high <= TYPES[name].high)


def _placement(
    variable: ExpandedVariable,
    spec: RegisterSpec,
    path: tuple[Step, ...],
    place: tuple[int, int | None],
    default_order: str,
    *,
    width: int,
) -> ExpandedPlacement:
    address, bit = place
    single = (bit is not None and not spec.is_byte and not width) or spec.area.of_bits
    type_name = FIELD_TYPE if width else spec.type or _usual_type(variable, spec, single=single)
    order = _order(spec, type_name, default_order)
    scale = 1.0 if spec.scale is None else spec.scale
    offset = 0.0 if spec.offset is None else spec.offset
    problem = _bit_problem(variable, spec) if single else _number_problem(spec, type_name, width)
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
        variable, spec, path, spec.area, address, bit, shown, order, scale, offset, codec, problem, width
    )


def _order(spec: RegisterSpec, type_name: str, default: str) -> str:
    """The order of the file is one of words and their bytes: what lies in one register it leaves as it is.

    A `bool` is 0 or 1 whatever is written beside it; numbers of 16 bits can have an order of their own.
    """
    order, number = spec.order or default, TYPES.get(type_name)
    is_own = spec.order is not None and type_name not in ("bool", *_BYTES)
    return order if number is None or number.words > 1 or is_own else _WITHOUT_BYTES.get(order, order)


_WITHOUT_BYTES: Final = {"BADC": "ABCD", "DCBA": "CDAB"}
"""The same order of words, without turning their bytes."""


def _bit_problem(variable: ExpandedVariable, spec: RegisterSpec) -> PlacementProblem | None:
    if variable.kind is not ValueKind.BOOL:
        return PlacementProblem.NUMBER_IN_BIT
    if spec.type not in (None, "bit", "bool"):
        return PlacementProblem.TYPE_IN_BIT
    if spec.scale is not None or spec.offset is not None or spec.order is not None:
        return PlacementProblem.SCALED_BIT
    return None


def _number_problem(spec: RegisterSpec, type_name: str, width: int) -> PlacementProblem | None:
    if width:
        if spec.type is not None or spec.order is not None or spec.is_byte:
            return PlacementProblem.TYPE_OF_BITS
        return PlacementProblem.SCALE_OF_ZERO if spec.scale == 0 else None
    if spec.is_byte != (type_name in _BYTES):
        return PlacementProblem.BYTE_TYPE
    if type_name not in TYPES:
        return PlacementProblem.BIT_WITHOUT_PLACE
    return PlacementProblem.SCALE_OF_ZERO if spec.scale == 0 else None
