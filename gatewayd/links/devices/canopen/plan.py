"""The compiled CANopen device, immutable; no data sheet is needed beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.describe import object_text
from gatewayd.canopen.manager.plan import ManagerPlan, NodePlan
from gatewayd.core.definition import CellDefinition
from gatewayd.links.devices.plan import DevicePlan

TYPES: Final = {
    "bit": CanType.BOOLEAN,
    "bool": CanType.BOOLEAN,
    "int8": CanType.INTEGER8,
    "uint8": CanType.UNSIGNED8,
    "int16": CanType.INTEGER16,
    "uint16": CanType.UNSIGNED16,
    "int32": CanType.INTEGER32,
    "uint32": CanType.UNSIGNED32,
    "int64": CanType.INTEGER64,
    "uint64": CanType.UNSIGNED64,
    "float32": CanType.REAL32,
    "float64": CanType.REAL64,
}
"""The words of a mapping for types that objects have."""
WORDS: Final = {kind: word for word, kind in TYPES.items() if word != "bool"}


@dataclass(frozen=True, slots=True)
class ObjectPlace:
    """Where one variable lies in the device."""

    variable: int
    """Index into `CellDefinition.variables`."""
    index: int
    subindex: int
    type: CanType
    linear: tuple[float, float] | None = None
    """Scale and offset; None: numbers go as they are."""
    pdo: int | None = None
    """Place of its PDO in `NodePlan.pdos`; None: it goes by SDO."""
    item: int = 0
    """Place in that PDO."""
    poll: float | None = None
    """Of an input by SDO: seconds between two reads."""

    @property
    def address(self) -> str:
        """`6004h:00`."""
        return object_text(self.index, self.subindex)


@dataclass(frozen=True, slots=True, kw_only=True)
class CanopenDevicePlan(DevicePlan):
    """One node that this gateway manages."""

    family: ClassVar[str] = "canopen"

    bus: ManagerPlan
    """Equal for all devices of a bus."""
    node: NodePlan
    places: tuple[ObjectPlace, ...]

    @property
    def address(self) -> str:
        """`can1 node 5`."""
        return f"{self.bus.channel} node {self.node.node}"

    def identity(self, cell: CellDefinition) -> object:
        """Everything; variables and writer by name."""
        places = tuple(
            (
                cell.variables[place.variable].name,
                cell.variables[place.variable].direction,
                cell.variables[place.variable].kind,
                cell.variables[place.variable].limits,
                replace(place, variable=0),
            )
            for place in self.places
        )
        sendings = tuple(
            (cell.variables[each.variable].name, each.brings_up_to_date, each.every) for each in self.sendings
        )
        writer = cell.writers[self.writer].name if self.writer is not None else None
        return places, sendings, writer, replace(self, writer=None, places=(), sendings=())
