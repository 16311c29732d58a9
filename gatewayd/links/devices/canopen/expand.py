"""From the places of a CANopen device to its objects, and to the PDOs that carry them.

| place | how it goes |
|---|---|
| `pdo: N` | in PDO N of the device, which the gateway lays out with all objects that name it, in file order |
| `pdo: none` | by SDO |
| neither, and a PDO of the data sheet has the object | in that PDO, which is taken as it is |
| neither, and none has it | by SDO |

A PDO from the robot that is taken as it is may have objects that nothing is mapped to: these stay as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from gatewayd.canopen.cob_ids import BASIC_FRAME, predefined_pdo
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.manager.data_sheet import SheetObject
from gatewayd.canopen.manager.plan import MAX_PDO_BITS, ManagedPdo, PdoObject
from gatewayd.core.definition import Direction
from gatewayd.links.devices.canopen.plan import TYPES
from gatewayd.links.devices.canopen.scalars import NO_PDO
from gatewayd.links.devices.canopen.sheets import SheetFile, sheet_of
from gatewayd.links.devices.places import ExpandedPlace
from gatewayd.links.devices.sections import DevicePlaceSpec, DeviceSpec
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedVariable

_SYNCHRONOUS: Final = 1
_EVENT: Final = 255


class ObjectProblem(Enum):
    """Why a variable cannot lie in an object."""

    NO_OBJECT = auto()
    """The data sheet has none of that index and sub-index."""
    NO_TYPE = auto()
    """Neither a data sheet nor the mapping says how its number is made."""
    NO_NUMBER = auto()
    """It is a string, or a number of an odd width."""
    OTHER_TYPE = auto()
    """The mapping says another type than the data sheet."""
    READ_ONLY = auto()
    WRITE_ONLY = auto()
    SCALE_OF_ZERO = auto()
    SCALED_BOOLEAN = auto()


@dataclass(frozen=True, slots=True)
class ExpandedObject:
    """Where one variable lies in a CANopen device."""

    index: int
    subindex: int
    type: CanType
    linear: tuple[float, float] | None
    entry: SheetObject | None
    """What the data sheet says of it; None without one."""
    problem: ObjectProblem | None = None


@dataclass(frozen=True, slots=True)
class DeviceLayout:
    """The PDOs of a device, and what goes by which."""

    pdos: tuple[ManagedPdo, ...]
    """TPDOs, then RPDOs, each by number; those that nothing goes by are left out."""
    carried: dict[int, tuple[int, int]]
    """Place of a variable among those of the device -> place of its PDO, and in it."""
    too_long: tuple[ManagedPdo, ...]
    """Those that no frame can carry, which are left out."""
    without_cob_id: tuple[ManagedPdo, ...]
    """Those of which nobody says the COB-ID, which are left out."""


def sheet_file(document: Document, device: Part[DeviceSpec]) -> SheetFile | None:
    """The data sheet of a device; None where it names none, or has no node-ID."""
    spec = device.spec
    return sheet_of(document, spec.eds, spec.node) if spec.eds is not None and spec.node is not None else None


def expand_line(
    document: Document, device: Part[DeviceSpec], spec: DevicePlaceSpec, variables: Sequence[ExpandedVariable]
) -> Iterable[ExpandedObject]:
    """The objects of one line: sub-index after sub-index. Never raises."""
    found = sheet_file(document, device)
    sheet = found.sheet if found is not None else None
    for number, variable in enumerate(variables):
        assert spec.object is not None
        subindex = spec.sub + number
        entry = sheet.find(spec.object, subindex) if sheet is not None else None
        kind = _type_of(entry, spec)
        is_linear = spec.scale is not None or spec.offset is not None
        linear = (spec.scale if spec.scale is not None else 1.0, spec.offset or 0.0) if is_linear else None
        problem = _problem(
            entry, spec, variable, has_sheet=sheet is not None, unreadable=bool(found and not sheet)
        )
        yield ExpandedObject(spec.object, subindex, kind, linear, entry, problem)


def _type_of(entry: SheetObject | None, spec: DevicePlaceSpec) -> CanType:
    if entry is not None and entry.type is not None and entry.type.char:
        return entry.type
    return TYPES[spec.type] if spec.type is not None else CanType.UNSIGNED32


def _problem(
    entry: SheetObject | None,
    spec: DevicePlaceSpec,
    variable: ExpandedVariable,
    *,
    has_sheet: bool,
    unreadable: bool,
) -> ObjectProblem | None:
    if unreadable:
        return None  # a finding of its own, and nothing is known of any object
    if entry is None and (has_sheet or spec.sub > 0xFF):
        return ObjectProblem.NO_OBJECT
    if entry is None and spec.type is None:
        return ObjectProblem.NO_TYPE
    kind = entry.type if entry is not None else TYPES[spec.type or "uint32"]
    if kind is None or not kind.char:
        return ObjectProblem.NO_NUMBER
    if spec.type is not None and TYPES[spec.type] is not kind:
        return ObjectProblem.OTHER_TYPE
    is_input = variable.direction is Direction.INPUT
    if entry is not None and is_input and not entry.readable and not entry.transmitted:
        return ObjectProblem.WRITE_ONLY
    if entry is not None and not is_input and not entry.writable:
        return ObjectProblem.READ_ONLY
    if spec.scale == 0:
        return ObjectProblem.SCALE_OF_ZERO
    if kind is CanType.BOOLEAN and (spec.scale is not None or spec.offset is not None):
        return ObjectProblem.SCALED_BOOLEAN
    return None


def object_of(place: ExpandedPlace) -> ExpandedObject | None:
    """Where a place is in a CANopen device; None in another one."""
    return place.where if isinstance(place.where, ExpandedObject) else None


def lay_out(document: Document, device: Part[DeviceSpec], places: Sequence[ExpandedPlace]) -> DeviceLayout:
    """The PDOs of a device, whose places these are."""
    return _Layout(document, device, places).finished()


class _Layout:
    def __init__(self, document: Document, device: Part[DeviceSpec], places: Sequence[ExpandedPlace]) -> None:
        found = sheet_file(document, device)
        self._sheet = found.sheet if found is not None else None
        self._spec = device.spec
        self._places = places
        self._pdos: dict[tuple[bool, int], ManagedPdo] = {}
        self._too_long: list[ManagedPdo] = []
        self._without_cob_id: list[ManagedPdo] = []

    def finished(self) -> DeviceLayout:
        for transmit in (True, False):
            self._lay_out_written(transmit=transmit)
            self._take_as_they_are(transmit=transmit)
        pdos = tuple(
            pdo for _, pdo in sorted(self._pdos.items(), key=lambda item: (not item[0][0], item[0][1]))
        )
        carried = {}
        for number, place in enumerate(self._places):
            found = self._carrier(place, pdos)
            if found is not None:
                carried[number] = found
        used = sorted({pdo for pdo, _ in carried.values()})
        places = {old: new for new, old in enumerate(used)}
        return DeviceLayout(
            tuple(pdos[old] for old in used),
            {number: (places[pdo], item) for number, (pdo, item) in carried.items()},
            tuple(self._too_long),
            tuple(self._without_cob_id),
        )

    def _lay_out_written(self, *, transmit: bool) -> None:
        wanted: dict[int, list[PdoObject]] = {}
        for place in self._places:
            found, order = object_of(place), place.spec.pdo
            if found is None or not isinstance(order, int) or place.is_read is not transmit:
                continue
            item = PdoObject(found.index, found.subindex, found.type.bits, found.type)
            objects = wanted.setdefault(order, [])
            if item not in objects:
                objects.append(item)
        for order, objects in wanted.items():
            pdo = self._written(order, objects, transmit=transmit)
            if sum(item.bits for item in objects) > MAX_PDO_BITS:
                self._too_long.append(pdo)
            elif not pdo.cob_id:
                self._without_cob_id.append(pdo)
            else:
                self._pdos[transmit, order] = pdo

    def _written(self, order: int, objects: Sequence[PdoObject], *, transmit: bool) -> ManagedPdo:
        spec, parameter = self._spec, (0x1800 if transmit else 0x1400) + order - 1
        known = self._sheet.number(parameter, 1) if self._sheet is not None else None
        assert spec.node is not None
        own = (known or 0) & BASIC_FRAME or predefined_pdo(order, spec.node, transmit=transmit) or 0
        return ManagedPdo(
            order,
            transmit,
            own,
            tuple(objects),
            written=True,
            transmission=_SYNCHRONOUS if spec.transmission == "sync" else _EVENT,
            inhibit=_ticks(spec.inhibit, 10_000) if transmit else None,
            event=_ticks(spec.event, 1000) if transmit else None,
            no_remote=bool((known or 0) & 0x4000_0000),
            spacing=0.0 if transmit else spec.inhibit or 0.0,
        )

    def _take_as_they_are(self, *, transmit: bool) -> None:
        wanted = {
            (found.index, found.subindex)
            for place in self._places
            if place.spec.pdo is None
            and place.is_read is transmit
            and (found := object_of(place)) is not None
        }
        for pdo in self._sheet.pdos() if self._sheet is not None and wanted else ():
            known = (transmit, pdo.number) in self._pdos or pdo.transmit is not transmit
            bits = sum(item.bits for item in pdo.objects)
            if known or bits > MAX_PDO_BITS or not all(item.bits for item in pdo.objects):
                continue
            if any((item.index, item.subindex) in wanted for item in pdo.objects):
                self._pdos[transmit, pdo.number] = pdo

    @staticmethod
    def _carrier(place: ExpandedPlace, pdos: Sequence[ManagedPdo]) -> tuple[int, int] | None:
        found, order = object_of(place), place.spec.pdo
        if found is None or order == NO_PDO:
            return None
        for number, pdo in enumerate(pdos):
            if pdo.transmit is not place.is_read or (order is not None and pdo.number != order):
                continue
            for item, mapped in enumerate(pdo.objects):
                if (mapped.index, mapped.subindex) == (found.index, found.subindex):
                    return number, item
        return None


def _ticks(seconds: float | None, rate: int) -> int | None:
    return None if seconds is None else min(round(seconds * rate), 0xFFFF)
