"""From the device keys of a document to concrete places, each with its place in the file.

A place whose device is not named, not declared or broken has none: rules make findings of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from gatewayd.links.devices.families import FAMILIES, language_of_family
from gatewayd.links.devices.family import FamilyLanguage
from gatewayd.links.devices.places import ExpandedPlace
from gatewayd.links.devices.sections import DevicePlaces, DeviceSpec
from gatewayd.links.modbus_places.placing import ExpandedPlacement, ExpandedPlaces
from gatewayd.mapping.document import Document
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable


@dataclass(frozen=True, slots=True)
class ExpandedDevices(ExpandedPlaces):
    """The places of a cell in devices. `placements`: those in Modbus devices."""

    places: tuple[ExpandedPlace, ...] = field(default=())
    """By variable, in file order."""

    @property
    def is_complete(self) -> bool:
        """Whether every variable lies in a device, and can lie there."""
        placed = all(placement.problem is None for placement in self.placements)
        return placed and all(_is_laid_out(place) for place in self.places)

    def of(self, device: str) -> tuple[ExpandedPlace, ...]:
        """The places in one device, by its name."""
        return tuple(place for place in self.places if place.name == device)


def devices_of(cell: ExpandedCell) -> ExpandedDevices:
    """The places of a cell in devices."""
    return cell.link(ExpandedDevices) or ExpandedDevices(())


def _is_laid_out(place: ExpandedPlace) -> bool:
    if place.device is None or place.where is None:
        return False
    return family_of(place.device.spec).is_laid_out(place.where)


def family_of(device: DeviceSpec) -> FamilyLanguage:
    """The family that a device is of."""
    return next(family for family in all_families() if device.selector in family.selectors)


def all_families() -> tuple[FamilyLanguage, ...]:
    """What the families add to the language, in order."""
    return tuple(map(language_of_family, FAMILIES))


def expand_devices(document: Document, variables: Iterable[ExpandedVariable]) -> ExpandedDevices:
    """Lay the variables out. Never raises."""
    lines: dict[str, list[ExpandedVariable]] = {}
    for variable in variables:
        lines.setdefault(variable.part.name, []).append(variable)
    found = [place for line in lines.values() for place in _line(document, line)]
    found.sort(key=lambda place: place.variable.index)
    placements = tuple(place.where for place in found if isinstance(place.where, ExpandedPlacement))
    return ExpandedDevices(placements, tuple(found))


def _line(document: Document, variables: Sequence[ExpandedVariable]) -> Iterator[ExpandedPlace]:
    devices = document.parts(DeviceSpec)
    declared = document.declared("devices")
    for number, spec in enumerate(variables[0].spec.by(DevicePlaces).device):
        name = spec.at or (next(iter(declared)) if len(declared) == 1 else "")
        device = devices.get(name)
        family = family_of(device.spec) if device is not None else None
        places: Sequence[object] = [None] * len(variables)
        if device is not None and family is not None and spec.selector in family.place_selectors:
            places = family.expand(document, device, spec, variables, number)
        for variable, where in zip(variables, places, strict=True):
            yield ExpandedPlace(variable, spec, number, name, device, where)
