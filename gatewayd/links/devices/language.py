"""Devices in the mapping language."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Final

from gatewayd.core.definition import Direction
from gatewayd.links.can_buses import BusUse
from gatewayd.links.devices.declaration import KIND
from gatewayd.links.devices.expand import ExpandedDevices, devices_of, expand_devices, family_of
from gatewayd.links.devices.places import ExpandedPlace
from gatewayd.links.devices.plan import DevicePlan, Sending
from gatewayd.links.devices.sections import DevicePlaces, DevicePlaceSpec, DeviceSpec, DeviceWriter
from gatewayd.links.language import LinkLanguage
from gatewayd.links.modbus_places.types import PLACE_RULES, TYPE_SYNONYMS, reach_of
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.model import VariableSpec, WriterSpec
from gatewayd.mapping.reach import Reach
from gatewayd.mapping.section import Section

MIN_LOST_AFTER: Final = 1.0
"""Seconds without an answer after which a device counts as lost at the earliest, unless the file says otherwise."""


class DevicesLanguage(LinkLanguage):
    """Section `devices`, and the key `device` of variables and writers."""

    key = KIND.key
    section_key = "devices"
    section = DeviceSpec
    several = True
    meaning = "devices that the gateway talks to by itself, by name"
    variable_keys = DevicePlaces
    writer_keys = DeviceWriter
    rules = (
        *PLACE_RULES,
        *(
            f"gatewayd.links.devices.rules.{name}"
            for name in ("places", "declared", "lines", "objects", "buses")
        ),
    )
    tables = "gatewayd.links.devices.tables"
    nested: ClassVar[Mapping[tuple[type[Section], str], type[Section]]] = {
        (VariableSpec, "device"): DevicePlaceSpec
    }
    articles: ClassVar[Mapping[type[Section], str]] = {
        DeviceSpec: "a device",
        DevicePlaceSpec: "a place in `device`",
    }
    places = (DevicePlaceSpec,)
    synonyms: ClassVar[Mapping[tuple[str, str], str]] = TYPE_SYNONYMS
    way = "device"
    writer_example = "device: island"
    place_example = "device: {at: island, holding: N}"
    lost_by = "a device is lost when it does not answer any more (`lost_after`)"

    def knows(self, writer: WriterSpec) -> bool:
        """Whether it is a device."""
        return writer.by(DeviceWriter).device is not None

    def names(self, writer: WriterSpec) -> Sequence[str]:
        """The name of the device."""
        name = writer.by(DeviceWriter).device
        return () if name is None else (f"device {name}",)

    def supervises(self, writer: WriterSpec) -> bool:
        """A device is asked again and again, and lost when it does not answer."""
        return self.knows(writer)

    def ways_of_writer(self, writer: WriterSpec) -> frozenset[str]:
        """Its device alone."""
        return frozenset(self.names(writer))

    def ways_of_variable(self, variable: ExpandedVariable, cell: ExpandedCell) -> frozenset[str]:
        """The devices in which it has a place."""
        return frozenset(f"device {place.name}" for place in self._of(variable, cell))

    def writes_whole(
        self, writer: WriterSpec, variables: Sequence[ExpandedVariable], cell: ExpandedCell
    ) -> bool:
        """Whether the device has all of them: what is owned together is written together, however it was read."""
        ways = self.ways_of_writer(writer)
        return bool(ways) and all(ways <= self.ways_of_variable(variable, cell) for variable in variables)

    def places_of(self, line: Part[VariableSpec], document: Document) -> bool:
        """Whether the line has a place in a device."""
        return bool(line.spec.by(DevicePlaces).device)

    def reaches(self, cell: ExpandedCell) -> Iterable[tuple[int, Reach]]:
        """What its registers and objects show of outputs, and which values of inputs come from them."""
        for placement in devices_of(cell).placements:
            if placement.codec is not None:
                yield _reached(placement.variable, reach_of(placement.codec, placement.width))
        for place in devices_of(cell).places:
            if place.device is not None and place.where is not None:
                reach = family_of(place.device.spec).reach(place.where)
                if reach is not None:
                    yield _reached(place.variable, reach)

    def bus_uses(self, cell: ExpandedCell) -> Iterable[BusUse]:
        """Its CANopen devices."""
        for name, device in cell.document.parts(DeviceSpec).items():
            yield from family_of(device.spec).bus_uses(cell, device, devices_of(cell).of(name))

    def expand(self, document: Document, variables: Sequence[ExpandedVariable]) -> ExpandedDevices:
        """The places, be there devices or not: rules look at them too."""
        return expand_devices(document, variables)

    def compile_links(self, cell: ExpandedCell) -> Mapping[str, DevicePlan]:
        """A plan for each device."""
        devices = cell.document.parts(DeviceSpec)
        return {name: _compile(cell, number, device) for number, (name, device) in enumerate(devices.items())}

    @staticmethod
    def _of(variable: ExpandedVariable, cell: ExpandedCell) -> Iterable[ExpandedPlace]:
        return (place for place in devices_of(cell).places if place.variable.index == variable.index)


def _reached(variable: ExpandedVariable, reach: Reach) -> tuple[int, Reach]:
    return variable.index, replace(reach, is_source=variable.direction is Direction.INPUT)


def _compile(cell: ExpandedCell, number: int, device: Part[DeviceSpec]) -> DevicePlan:
    name = device.name
    places = devices_of(cell).of(name)
    writers = (part.spec.by(DeviceWriter).device for part in cell.document.writers.values())
    common: dict[str, Any] = {
        "name": name,
        "number": number,
        "writer": next((index for index, its in enumerate(writers) if its == name), None),
        "lost_after": lost_after(device.spec, places),
        "watchdog": device.spec.watchdog,
        "sendings": tuple(
            Sending(place.variable.index, place.spec.on_connect == "write", place.spec.every)
            for place in places
            if place.variable.direction is Direction.OUTPUT
        ),
    }
    return family_of(device.spec).compile(cell, device, places, common)


def lost_after(device: DeviceSpec, places: Iterable[ExpandedPlace]) -> float:
    """Seconds without an answer after which it counts as lost: as written, or three polls and a time-out.

    Three time-outs where frames are those of a serial line: after each the device is left alone for a while, and one
    answer that is lost must not be a device that is lost.
    """
    if device.lost_after is not None:
        return device.lost_after
    is_rtu = device.serial is not None or device.framing == "rtu"
    time_outs = 3 if is_rtu else 1
    return max(MIN_LOST_AFTER, 3 * slowest_poll(device, places) + time_outs * device.timeout)


def slowest_poll(device: DeviceSpec, places: Iterable[ExpandedPlace]) -> float:
    """The longest time between two reads of any of its values."""
    polls = [place.poll for place in places if place.variable.direction is Direction.INPUT]
    return max(polls, default=device.poll)


LANGUAGE: Final = DevicesLanguage()
