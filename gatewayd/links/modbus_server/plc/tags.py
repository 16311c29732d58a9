"""From the places of a Modbus unit to tags: which place of each variable the PLC uses, and as which type."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plan import Placement
from gatewayd.links.modbus_server.plc.model import RegisterTag
from gatewayd.modbus.areas import Area
from gatewayd.plc.model import Encoding
from gatewayd.plc.tags import tag_keys

_READ_ORDER: Final = (Area.HOLDING, Area.INPUT, Area.COIL, Area.DISCRETE)
_WRITE_ORDER: Final = (Area.HOLDING, Area.COIL)


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


def tag_of(place: Placement, cell: CellDefinition) -> RegisterTag:
    """One variable as the PLC sees it. Raises ExportError for a scaled bool."""
    variable = cell.variables[place.variable]
    codec = place.codec
    encoding = None if codec is None else Encoding(codec.type, codec.order, codec.scale, codec.offset)
    keys = tag_keys(variable, cell, encoding)
    if encoding is not None and encoding.is_scaled and keys["type"] == "BOOL":
        raise ExportError(
            f"`{variable.name}` lies in a register of type bool with a scale: strike `scale` and `offset` there"
        )
    return RegisterTag(**keys, bit=place.bit, area=place.area, address=place.address)
