"""Rules GW842 to GW847: CAN buses that the gateway manages, be their devices and nodes of one cell or of several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from gatewayd.canopen.load import ERROR_ABOVE, WARNING_ABOVE, load
from gatewayd.links.can_buses import BusUse
from gatewayd.links.devices.canopen.bus_load import manager_shares
from gatewayd.links.devices.canopen.managed_bus import bus_of
from gatewayd.links.devices.declaration import KIND
from gatewayd.links.devices.sections import DeviceSpec
from gatewayd.links.registry import languages
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import plant_rule
from gatewayd.report.wording import cob

_OF_THE_BUS = ("sync", "manager", "manager_heartbeat")
"""Keys of a device that concern the whole bus."""


@dataclass(frozen=True, slots=True)
class _Device:
    cell: ExpandedCell
    part: Part[DeviceSpec]

    @property
    def bus(self) -> tuple[str, str]:
        return self.part.spec.interface, self.part.spec.canopen or ""


@plant_rule("GW842")
def node_id_on_managed_bus(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """A node-ID that two nodes on a managed bus have."""
    for uses, devices in _buses(cells):
        first: dict[int, BusUse] = {}
        for use in uses:
            other = first.setdefault(use.node, use)
            if other is not use:
                message = f"node {use.node} on {use.channel} is {use.what} here, and {other.what} as well"
                related = (Related(other.position, f"node {use.node} first used here"),)
                yield rule.at(
                    use.position, message, hint="give one of the two another node-ID", related=related
                )
        for device in devices:
            number = device.part.spec.manager
            if number is not None and number in first:
                message = (
                    f"the manager of {device.bus[1]} is node {number} here, which is {first[number].what}"
                )
                related = (Related(first[number].position, f"node {number} first used here"),)
                hint = "give the manager a node-ID of its own, for example 127"
                yield rule.at(device.part.at("manager"), message, hint=hint, related=related)
                break


@plant_rule("GW843")
def managed_bus_set_up_twice(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Devices or nodes on one bus that say different things of it."""
    for uses, devices in _buses(cells):
        rates = [use for use in uses if use.bitrate != uses[0].bitrate]
        if rates:
            use = rates[0]
            message = (
                f"{use.channel} has {use.bitrate} bit/s here, and {uses[0].bitrate} bit/s for {uses[0].what}"
            )
            related = (Related(uses[0].bitrate_position, f"{uses[0].bitrate} bit/s is here"),)
            yield rule.at(
                use.bitrate_position, message, hint="write the bit-rate of the bus at both", related=related
            )
        yield from _contradictions(rule, devices)


def _contradictions(rule: Rule, devices: Sequence[_Device]) -> Iterator[Diagnostic]:
    """Every cell is compiled by itself, so what concerns the bus has to be said in each that has devices on it."""
    for key in _OF_THE_BUS:
        said = [device for device in devices if _value(device, key) is not None]
        if not said:
            continue
        first, cells = said[0], [device.cell for device in said]
        other = next((each for each in said if _value(each, key) != _value(first, key)), None)
        silent = next((each for each in devices if not any(each.cell is cell for cell in cells)), None)
        wrong = other or silent
        if wrong is not None:
            message = f"`{key}` of {wrong.bus[1]} is not what `{first.part.name}` says of it"
            related = (Related(first.part.at(key), f"`{first.part.name}` says so here"),)
            hint = f"write the same `{key}` at the devices of a bus, in each file that has some"
            place = wrong.part.at(key) if other is not None else wrong.part.key
            yield rule.at(place, message, hint=hint, related=related)


def _value(device: _Device, key: str) -> object:
    return getattr(device.part.spec, key)


@plant_rule("GW844", Severity.WARNING)
def manager_beside_own_node(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """A bus on which the gateway is both a node for a master and a manager."""
    for uses, devices in _buses(cells):
        own = [use for use in uses if not any(use.position == _node(device) for device in devices)]
        if own:
            use = own[0]
            message = (
                f"the gateway manages devices on {use.channel}, and is node {use.node} there for a master: "
                "two masters would command one bus"
            )
            related = (Related(devices[0].part.at("canopen"), f"`{devices[0].part.name}` is managed"),)
            hint = "put the devices on a bus of their own, unless nobody else there is an NMT master"
            yield rule.at(use.position, message, hint=hint, related=related)


@plant_rule("GW845", Severity.WARNING)
def managed_bus_load_high(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """A managed bus whose load can exceed 40 %."""
    yield from _loaded(rule, cells, lambda share: WARNING_ABOVE < share <= ERROR_ABOVE)


@plant_rule("GW846")
def managed_bus_load_too_high(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """A managed bus whose load can exceed 70 %."""
    yield from _loaded(rule, cells, lambda share: share > ERROR_ABOVE)


@plant_rule("GW847")
def cob_id_on_managed_bus(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """A COB-ID by which two PDOs on a managed bus are sent."""
    for uses, _ in _buses(cells):
        first: dict[int, tuple[BusUse, str]] = {}
        for use in uses:
            for can_id, what in use.sends.items():
                other, known = first.setdefault(can_id, (use, what))
                if other is not use and other.node != use.node:
                    message = f"{what} has the COB-ID {cob(can_id)}, which is {known} on the same bus"
                    related = (Related(other.position, known),)
                    hint = "use another PDO, or a DCF that sets its COB-ID"
                    yield rule.at(use.position, message, hint=hint, related=related)
                    break


def _loaded(
    rule: Rule, cells: Sequence[ExpandedCell], is_meant: Callable[[float], bool]
) -> Iterator[Diagnostic]:
    for uses, devices in _buses(cells):
        manager = manager_shares(bus_of(devices[0].cell.document, devices[0].part.spec))
        shares = [*manager, *(share for use in uses for share in use.shares)]
        use = next(use for use in uses if use.position == _node(devices[0]))
        share = load(shares, use.bitrate)
        if shares and is_meant(share):
            most = max(shares, key=lambda each: each.bits_per_second)
            message = (
                f"the load of {use.channel} can reach {share:.0%} of {use.bitrate} bit/s, "
                f"most of it from {most.what} ({most.rate:.4g} frames/s, {load([most], use.bitrate):.1%})"
            )
            hint = "poll more seldom, use `sync` or a longer `inhibit`, or a higher bit-rate"
            yield rule.at(use.bitrate_position, message, hint=hint)


def _buses(cells: Sequence[ExpandedCell]) -> Iterator[tuple[list[BusUse], list[_Device]]]:
    """All that is on each managed bus: in the order of the files, nodes before devices; and its devices."""
    found: dict[tuple[str, str], list[_Device]] = {}
    for cell in cells:
        if KIND.key not in cell.links:
            continue
        for part in cell.document.parts(DeviceSpec).values():
            if part.spec.canopen is not None and part.spec.node is not None:
                device = _Device(cell, part)
                found.setdefault(device.bus, []).append(device)
    if not found:
        return
    uses = [use for cell in cells for language in languages() for use in language.bus_uses(cell)]
    for bus, devices in found.items():
        yield [use for use in uses if use.bus == bus], devices


def _node(device: _Device) -> object:
    return device.part.at("node")
