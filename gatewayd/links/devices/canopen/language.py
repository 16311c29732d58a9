"""The family of CANopen devices in the mapping language."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from gatewayd.canopen.manager.plan import ExpectedIdentity, NodePlan, ObjectReading
from gatewayd.links.can_buses import BusUse
from gatewayd.links.canopen_values import reach_of
from gatewayd.links.devices.canopen.bus_load import device_shares
from gatewayd.links.devices.canopen.expand import (
    ExpandedObject,
    expand_line,
    lay_out,
    object_of,
    sheet_file,
)
from gatewayd.links.devices.canopen.managed_bus import BEATS, bus_of
from gatewayd.links.devices.canopen.plan import WORDS, CanopenDevicePlan, ObjectPlace
from gatewayd.links.devices.canopen.sections import CanopenDeviceKeys, CanopenPlaceKeys
from gatewayd.links.devices.family import FamilyLanguage
from gatewayd.links.devices.places import ExpandedPlace
from gatewayd.links.devices.sections import DevicePlaceSpec, DeviceSpec
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.reach import Reach

SDO_TIMEOUT: Final = 1.0
"""Seconds that a device has for an answer, unless its `timeout` says otherwise: drives take longer than 100 ms."""


class CanopenFamily(FamilyLanguage):
    """Key `canopen` of a device; objects of its dictionary as places."""

    name = CanopenDevicePlan.family
    selectors = ("canopen",)
    device_keys = frozenset(CanopenDeviceKeys.model_fields)
    place_selectors = ("object",)
    place_keys = frozenset(CanopenPlaceKeys.model_fields)
    place_example = "object: 0x6004"

    def expand(
        self,
        document: Document,
        device: Part[DeviceSpec],
        spec: DevicePlaceSpec,
        variables: Sequence[ExpandedVariable],
        number: int,
    ) -> Sequence[ExpandedObject]:
        """One sub-index after the other."""
        return tuple(expand_line(document, device, spec, variables))

    def is_laid_out(self, where: Any) -> bool:
        """Whether the variable can lie there."""
        return where.problem is None

    def reach(self, where: ExpandedObject) -> Reach | None:
        """What the object shows; None: all that its variable has."""
        return reach_of(where.type, where.linear) if where.type.bits > 1 else None

    def row(self, where: ExpandedObject) -> Mapping[str, object]:
        """`object 6004h:00`, with the type of the number and its scale."""
        scale, offset = where.linear or (None, None)
        return {
            "device_place": f"object {where.index:04X}h:{where.subindex:02X}",
            "device_type": WORDS[where.type],
            "device_scale": scale,
            "device_offset": offset,
        }

    def pdos(
        self, document: Document, device: Part[DeviceSpec], places: Sequence[ExpandedPlace]
    ) -> Mapping[int, str]:
        """`TPDO 1`, as the layout has it."""
        layout = lay_out(document, device, places)
        return {number: layout.pdos[pdo].label for number, (pdo, _) in layout.carried.items()}

    def bus_uses(
        self, cell: ExpandedCell, device: Part[DeviceSpec], places: Sequence[ExpandedPlace]
    ) -> Iterable[BusUse]:
        """The node, with its PDOs, its heartbeat and the reads of it."""
        spec = device.spec
        if spec.canopen is None or spec.node is None:
            return
        layout = lay_out(cell.document, device, places)
        yield BusUse(
            spec.interface,
            spec.canopen,
            spec.bitrate,
            spec.node,
            f"the device `{device.name}`",
            device.at("node"),
            device.at("bitrate") if "bitrate" in spec.model_fields_set else device.at("canopen"),
            {pdo.cob_id: f"{pdo.label} of `{device.name}`" for pdo in layout.pdos},
            tuple(device_shares(cell, device, places)),
        )

    def compile(
        self,
        cell: ExpandedCell,
        device: Part[DeviceSpec],
        places: Sequence[ExpandedPlace],
        common: Mapping[str, Any],
    ) -> CanopenDevicePlan:
        """One node of a bus."""
        layout = lay_out(cell.document, device, places)
        # What PDOs have brought is confirmed by each heartbeat, so it must not be too old before the next one.
        lost_after = max(common["lost_after"], device.spec.heartbeat or 0.0)
        compiled = tuple(_place(place, layout.carried.get(number)) for number, place in enumerate(places))
        return CanopenDevicePlan(
            **{**common, "lost_after": lost_after},
            bus=bus_of(cell.document, device.spec),
            node=_node(cell, device, places, lost_after),
            places=compiled,
        )


def sdo_timeout(spec: DeviceSpec) -> float:
    """Seconds within which a device answers."""
    return spec.timeout if "timeout" in spec.model_fields_set else SDO_TIMEOUT


def producer_time(spec: DeviceSpec) -> int:
    """Milliseconds between two heartbeats that the device is told to send; 0: none."""
    return max(1, round(1000 * spec.heartbeat / BEATS)) if spec.heartbeat is not None else 0


def _node(
    cell: ExpandedCell, device: Part[DeviceSpec], places: Sequence[ExpandedPlace], lost_after: float
) -> NodePlan:
    spec, found = device.spec, sheet_file(cell.document, device)
    sheet = found.sheet if found is not None else None
    layout = lay_out(cell.document, device, places)
    known = sheet.identity if sheet is not None else ExpectedIdentity()
    settings = sheet.settings() if sheet is not None else ()
    readings: dict[tuple[int, int], ObjectReading] = {}
    for number, place in enumerate(places):
        placed = object_of(place)
        if placed is None or not place.is_read or (placed.entry is not None and not placed.entry.readable):
            continue
        period = 0.0 if number in layout.carried else place.poll
        at = placed.index, placed.subindex
        before = readings.get(at)
        # Read by several lines: as often as the most impatient one wants it.
        if before is None or not before.period or (period and period < before.period):
            readings[at] = ObjectReading(*at, placed.type, period)
    assert spec.node is not None
    return NodePlan(
        spec.node,
        expected=ExpectedIdentity(
            known.device_type, known.vendor, known.product, spec.revision, spec.expected_serial
        ),
        mandatory=spec.mandatory,
        keep=spec.keep,
        heartbeat=spec.heartbeat or 0.0,
        producer=producer_time(spec),
        alive=lost_after / BEATS,
        software=spec.software,
        settings=settings,
        configured=sheet.modified if sheet is not None and settings else None,
        store=spec.store,
        sdo_timeout=sdo_timeout(spec),
        pdos=layout.pdos,
        readings=tuple(readings.values()),
    )


def _place(place: ExpandedPlace, carried: tuple[int, int] | None) -> ObjectPlace:
    found = object_of(place)
    assert found is not None
    pdo, item = carried if carried is not None else (None, 0)
    poll = place.poll if place.is_read and carried is None else None
    return ObjectPlace(
        place.variable.index, found.index, found.subindex, found.type, found.linear, pdo, item, poll
    )


FAMILY: Final = CanopenFamily()
"""What this family adds to the mapping language."""
