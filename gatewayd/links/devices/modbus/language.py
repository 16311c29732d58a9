"""Modbus devices in the mapping language: places, and plans."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from gatewayd.core.definition import Direction
from gatewayd.links.devices.family import FamilyLanguage
from gatewayd.links.devices.modbus.plan import DevicePlacement, LineAddress, ModbusDevicePlan, SerialSettings
from gatewayd.links.devices.modbus.sections import ModbusDeviceKeys, ModbusPlaceKeys
from gatewayd.links.devices.places import ExpandedPlace
from gatewayd.links.devices.sections import DevicePlaceSpec, DeviceSpec
from gatewayd.links.modbus_places.placing import ExpandedPlacement, place_line
from gatewayd.links.modbus_places.sections import AREA_KEYS
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.modbus.areas import AREA_NAMES
from gatewayd.modbus.codec import turns

DEFAULT_BAUDRATE: Final = 19200
"""Modbus over Serial Line V1.02, 2.5.1: what is used where nothing else is said. A rule asks for the key."""


def line_of(spec: DeviceSpec) -> LineAddress:
    """The connection that a device is reached by."""
    if spec.serial is not None:
        settings = SerialSettings(spec.baudrate or DEFAULT_BAUDRATE, spec.parity, spec.stop_bits)
        return LineAddress(spec.serial, framing="rtu", serial=settings)
    assert spec.modbus is not None
    return LineAddress(spec.modbus.host, spec.modbus.port, spec.framing or "tcp")


def placement_of(place: ExpandedPlace) -> ExpandedPlacement | None:
    """Where a place is in a Modbus device; None in another one."""
    return place.where if isinstance(place.where, ExpandedPlacement) else None


class ModbusFamily(FamilyLanguage):
    """Keys `modbus` and `serial` of a device; coils, inputs and registers as places."""

    name = ModbusDevicePlan.family
    selectors = ("modbus", "serial")
    device_keys = frozenset(ModbusDeviceKeys.model_fields)
    place_selectors = tuple(AREA_KEYS)
    place_keys = frozenset(ModbusPlaceKeys.model_fields)
    place_example = "holding: 100"

    def expand(
        self,
        document: Document,
        device: Part[DeviceSpec],
        spec: DevicePlaceSpec,
        variables: Sequence[ExpandedVariable],
        number: int,
    ) -> Sequence[ExpandedPlacement]:
        """One after the other from the place of the line on."""
        return tuple(place_line(variables, spec, ("device", number), device.spec.order, spec.bits))

    def row(self, where: ExpandedPlacement) -> Mapping[str, object]:
        """`discrete 3`, with the type of the number and its scale."""
        is_number = where.codec is not None
        order = f" {where.order}" if is_number and turns(where.order, where.type) else ""
        return {
            "device_place": f"{AREA_NAMES[where.area]} {where.place}",
            "device_type": f"{where.type}{order}",
            "device_scale": where.scale if is_number else None,
            "device_offset": where.offset if is_number else None,
        }

    def compile(
        self,
        cell: ExpandedCell,
        device: Part[DeviceSpec],
        places: Sequence[ExpandedPlace],
        common: Mapping[str, Any],
    ) -> ModbusDevicePlan:
        """One unit of a line."""
        spec = device.spec
        return ModbusDevicePlan(
            **common,
            line=line_of(spec),
            unit=spec.unit,
            timeout=spec.timeout,
            failures=spec.failures,
            gap=spec.gap,
            single=spec.single,
            per_request=spec.connect == "per_request",
            in_flight=spec.in_flight,
            write=spec.write,
            mask_write=spec.mask_write,
            poll=spec.poll,
            identify=spec.identify,
            serial_number=None
            if spec.serial_number is None
            else (spec.serial_number[0], len(spec.serial_number)),
            placements=tuple(map(_placement, places)),
        )


def _placement(place: ExpandedPlace) -> DevicePlacement:
    placed = placement_of(place)
    assert placed is not None
    is_input = place.variable.direction is Direction.INPUT
    is_part = placed.bit is not None
    return DevicePlacement(
        place.variable.index,
        placed.area,
        placed.address,
        placed.bit,
        placed.codec,
        placed.width,
        poll=place.poll if is_input else None,
        keeps_rest=place.spec.rest == "keep" if is_part and not is_input else None,
    )


FAMILY: Final = ModbusFamily()
"""What this family adds to the mapping language."""
