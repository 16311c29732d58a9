"""Where a variable lies in a device, laid out, with its place in the file."""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.core.definition import Direction
from gatewayd.links.devices.sections import DevicePlaceSpec, DeviceSpec
from gatewayd.mapping.diagnostics import Position
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedVariable


@dataclass(frozen=True, slots=True)
class ExpandedPlace:
    """Where one variable lies in a device."""

    variable: ExpandedVariable
    spec: DevicePlaceSpec
    number: int
    """Which of the places of its line it is."""
    name: str
    """Of the device, declared or not; empty where it is missing."""
    device: Part[DeviceSpec] | None
    """None where there is no valid one of that name."""
    where: object = None
    """What the family made of it (`FamilyLanguage.expand`); None without a device, and in one of another family."""

    def at(self, *path: str) -> Position:
        """Place of one of its keys, or of what stands there at all."""
        return self.variable.at("device", self.number, *path)

    @property
    def is_read(self) -> bool:
        """Whether the value comes from the device."""
        return self.variable.direction is Direction.INPUT

    @property
    def poll(self) -> float:
        """Seconds between two reads."""
        if self.spec.poll is not None:
            return self.spec.poll
        assert self.device is not None
        return self.device.spec.poll
