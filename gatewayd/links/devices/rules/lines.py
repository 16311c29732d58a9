"""Rules GW812, GW813 and GW815: devices that share a connection, be they of one cell or of several."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from gatewayd.links.devices.expand import devices_of
from gatewayd.links.devices.modbus.language import line_of, placement_of
from gatewayd.links.devices.modbus.plan import LineAddress
from gatewayd.links.devices.sections import DeviceSpec
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import plant_rule
from gatewayd.modbus.areas import Area
from gatewayd.report.wording import number

_SILENCE: Final = 3.5
"""Characters between two frames (Modbus over Serial Line V1.02, 2.5.1.1)."""
_MIN_SILENCE: Final = 0.00175
"""Seconds of it above 19,200 bit/s."""
_OVERHEAD: Final = 8 + 5
"""Bytes of a request for registers, and of its answer without values: address, function, count, CRC."""


@dataclass(frozen=True, slots=True)
class _Found:
    cell: ExpandedCell
    device: Part[DeviceSpec]
    line: LineAddress

    @property
    def name(self) -> str:
        return self.device.name


@plant_rule("GW812")
def same_unit_twice(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two devices with one unit on the same line."""
    first: dict[tuple[str, int, int], _Found] = {}
    for found in _modbus(cells):
        key = found.line.path, found.line.port, found.device.spec.unit
        other = first.setdefault(key, found)
        if other is not found:
            message = (
                f"`{found.name}` is unit {found.device.spec.unit} at {found.line.path}, "
                f"which `{other.name}` is already"
            )
            related = (Related(other.device.key, f"`{other.name}` is here"),)
            hint = "give it another `unit`, or map its variables in one device"
            yield rule.at(found.device.key, message, hint=hint, related=related)


@plant_rule("GW813")
def line_set_up_twice(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two devices on the same line that set it up in different ways."""
    first: dict[tuple[str, int], _Found] = {}
    for found in _modbus(cells):
        other = first.setdefault((found.line.path, found.line.port), found)
        if other.line != found.line:
            message = (
                f"`{found.name}` is at {found.line.text}, and `{other.name}` at "
                f"{other.line.text}: a line is set up in one way"
            )
            related = (Related(other.device.key, f"`{other.name}` is here"),)
            yield rule.at(found.device.key, message, hint="write the same settings at both", related=related)


@plant_rule("GW815", Severity.WARNING)
def poll_beyond_line(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Devices on a serial line that are polled more often than it can carry."""
    shares: dict[LineAddress, float] = {}
    last: dict[LineAddress, _Found] = {}
    for found in _modbus(cells):
        if found.line.is_serial:
            shares[found.line] = shares.get(found.line, 0.0) + _share(found)
            last[found.line] = found
    for line, share in shares.items():
        if share > 1:
            found = last[line]
            message = (
                f"the polls of {line.path} need {number(round(100 * share))} % of its time at "
                f"{line.serial.baudrate if line.serial else 0} bit/s, answers at once"
            )
            hint = "poll less often, raise `baudrate`, or let the variables lie side by side"
            yield rule.at(found.device.at("serial"), message, hint=hint)


def _share(found: _Found) -> float:
    """The share of a line's time that reading a device takes at least: values of one poll and area in one request."""
    assert found.line.serial is not None
    character = (
        10 + (found.line.serial.parity != "none") + (found.line.serial.stop_bits - 1)
    ) / found.line.serial.baudrate
    silence = 2 * max(_SILENCE * character, _MIN_SILENCE)
    values: dict[tuple[float, Area], set[int]] = {}
    for place in devices_of(found.cell).of(found.name):
        placed = placement_of(place)
        if placed is not None and place.is_read:
            values.setdefault((place.poll, placed.area), set()).update(placed.addresses)
    return sum(
        (
            (_OVERHEAD + (len(addresses) // 8 + 1 if area.of_bits else 2 * len(addresses))) * character
            + silence
        )
        / poll
        for (poll, area), addresses in values.items()
    )


def _modbus(cells: Sequence[ExpandedCell]) -> Iterator[_Found]:
    for cell in cells:
        for device in cell.document.parts(DeviceSpec).values():
            if device.spec.selector in ("modbus", "serial"):
                yield _Found(cell, device, line_of(device.spec))
