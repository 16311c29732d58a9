"""From the places of a Modbus unit to tags: which place of each variable the PLC uses, and as which type."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from gatewayd.core.definition import CellDefinition, Direction, ValueKind, Variable
from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plan import Placement
from gatewayd.links.modbus_server.plc.model import Encoding, Tag, TagFamily
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import TYPES, Codec
from gatewayd.report.printable import printable

WIRE_TYPES: Final[Mapping[str, str]] = {
    "bool": "BOOL",
    "int8": "SINT",
    "uint8": "USINT",
    "int16": "INT",
    "uint16": "UINT",
    "int32": "DINT",
    "uint32": "UDINT",
    "int64": "LINT",
    "uint64": "ULINT",
    "float32": "REAL",
    "float64": "LREAL",
}
"""Type of the mapping -> elementary type of a value that is the raw number."""

_READ_ORDER: Final = (Area.HOLDING, Area.INPUT, Area.COIL, Area.DISCRETE)
_WRITE_ORDER: Final = (Area.HOLDING, Area.COIL)
_REAL_STEPS: Final = 1 << 24
"""A REAL tells so many numbers from 0 apart."""


def places(placements: Iterable[Placement], cell: CellDefinition) -> Mapping[int, Placement]:
    """Index of the variable -> the place that the PLC uses: in registers where it has one, the first of them."""
    found: dict[int, list[Placement]] = {}
    for placement in placements:
        found.setdefault(placement.variable, []).append(placement)
    chosen = {}
    for index, its in sorted(found.items()):
        order = _WRITE_ORDER if cell.variables[index].direction is Direction.INPUT else _READ_ORDER
        fitting = [place for area in order for place in its if place.area is area]
        if fitting:
            chosen[index] = fitting[0]
    return chosen


def tag_of(place: Placement, cell: CellDefinition) -> Tag:
    """One variable as the PLC sees it. Raises ExportError for a scaled bool."""
    variable = cell.variables[place.variable]
    codec = place.codec
    member, element = _split(variable.name)
    kind, arithmetic = _value_type(variable, codec)
    return Tag(
        number=variable.number,
        name=variable.name,
        member=member,
        element=element,
        kind=variable.kind,
        type=kind,
        arithmetic=arithmetic,
        encoding=None if codec is None else Encoding(codec.type, codec.order, codec.scale, codec.offset),
        bit=place.bit,
        area=place.area,
        address=place.address,
        unit=printable(variable.unit),
        comment=printable(variable.comment),
        limits=variable.limits,
        on_stale=variable.on_stale,
        owners=tuple(writer + 1 for writer in owners(variable, cell)),
    )


def owners(variable: Variable, cell: CellDefinition) -> tuple[int, ...]:
    """Writers that may own it; none of an output."""
    return () if variable.lock is None else cell.locks[variable.lock].owners


def members(tags: Sequence[Tag]) -> tuple[TagFamily, ...]:
    """Variables and families of them, in the order of the mapping. Raises ExportError for a family with gaps."""
    return tuple(_members(tags))


def _members(tags: Sequence[Tag]) -> Iterator[TagFamily]:
    families: dict[str, list[Tag]] = {}
    for tag in tags:
        families.setdefault(tag.member, []).append(tag)
    for name, its in families.items():
        types = {tag.type for tag in its}
        whole = its[0].element is None or [tag.element for tag in its] == list(range(len(its)))
        if len(types) > 1 or not whole:
            raise ExportError(
                f"`{name}` is no array of one type: {', '.join(f'`{tag.name}` {tag.type}' for tag in its[:3])}: "
                "give all of its elements a place with the same owner, or put them into lines of their own"
            )
        yield TagFamily(name, its[0].type, tuple(its))


def _split(name: str) -> tuple[str, int | None]:
    member, bracket, rest = name.partition("[")
    return member, int(rest.removesuffix("]")) if bracket else None


def _value_type(variable: Variable, codec: Codec | None) -> tuple[str, str]:
    """Type of the value, and that of the arithmetic before it."""
    if codec is None or variable.kind is ValueKind.BOOL or codec.type == "bool":
        if codec is not None and (codec.scale, codec.offset) != (1, 0):
            raise ExportError(
                f"`{variable.name}` lies in a register of type bool with a scale: strike `scale` and `offset` there"
            )
        return "BOOL", ""
    if (codec.scale, codec.offset) == (1, 0):
        return WIRE_TYPES[codec.type], ""
    arithmetic = "REAL" if _fits_real(codec) else "LREAL"
    return arithmetic, arithmetic


def _fits_real(codec: Codec) -> bool:
    """Whether a REAL tells all of its values apart."""
    number = TYPES[codec.type]
    if number.is_real:
        return number.name == "float32"
    ends = [abs((raw * codec.scale + codec.offset) / codec.scale) for raw in (number.low, number.high)]
    return max(ends) < _REAL_STEPS
