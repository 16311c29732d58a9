"""From the Modbus keys of a document to concrete placements, each with its place in the file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from gatewayd.links.modbus_places.placing import ExpandedPlacement, ExpandedPlaces, place_line
from gatewayd.links.modbus_server.sections import Modbus, ModbusPlaces
from gatewayd.mapping.document import Document
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable


@dataclass(frozen=True, slots=True)
class ExpandedModbus(ExpandedPlaces):
    """The places of a cell in the areas of its Modbus unit."""


def placements_of(cell: ExpandedCell) -> tuple[ExpandedPlacement, ...]:
    """The places of a cell in the areas of its Modbus unit, by variable."""
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
    for number, spec in enumerate(variables[0].part.spec.by(ModbusPlaces).modbus):
        yield from place_line(variables, spec, ("modbus", number), default_order)
