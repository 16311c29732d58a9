"""Rules GW801 to GW808, GW819 and GW822: where variables lie in devices, and who writes them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from gatewayd.core.definition import Direction
from gatewayd.links.devices.expand import devices_of
from gatewayd.links.devices.modbus.language import placement_of
from gatewayd.links.devices.places import ExpandedPlace
from gatewayd.links.devices.sections import DeviceWriter
from gatewayd.links.modbus_places.rules.wording import where
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.modbus.areas import Area
from gatewayd.report.wording import alternatives, did_you_mean

_READ_ONLY = {Area.DISCRETE: "coil", Area.INPUT: "holding"}
"""Tables that nobody can write, and the one that can hold the same."""


@cell_rule("GW801")
def unknown_device(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A place or a writer in a device that is not among the devices."""
    known = cell.document.declared("devices")
    for place in _lines(cell):
        if place.name and place.name not in known:
            hint = did_you_mean(place.name, known, f"add `{place.name}` to the section `devices`")
            message = (
                f"`{place.name}`, where `{place.variable.part.name}` is to lie, is not among the devices"
            )
            yield rule.at(place.at("at"), message, hint=hint)
    for writer in cell.document.writers.values():
        name = writer.spec.by(DeviceWriter).device
        if name is not None and name not in known:
            hint = did_you_mean(name, known, f"add `{name}` to the section `devices`")
            yield rule.at(
                writer.at("device"),
                f"`{name}`, which `{writer.name}` is, is not among the devices",
                hint=hint,
            )


@cell_rule("GW802")
def device_not_named(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A place that does not say in which of several devices it is."""
    known = cell.document.declared("devices")
    for place in _lines(cell):
        if not place.name:
            message = f"`{place.variable.part.name}` does not say in which device it lies"
            hint = f"add `at:` with {alternatives(sorted(known))}" if known else "add a section `devices`"
            yield rule.at(place.at(), message, hint=hint)


@cell_rule("GW803")
def device_is_no_writer(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An input of the robot in a device that no writer is."""
    writers = _writers(cell)
    reported: set[str] = set()
    for place in _inputs(cell):
        if place.device is not None and place.name not in writers and place.name not in reported:
            reported.add(place.name)
            message = f"`{place.variable.part.name}` comes from `{place.name}`, which is none of the writers"
            hint = (
                f"add `{place.name}: {{device: {place.name}}}` to `writers`, and `owner: {place.name}` here"
            )
            yield rule.at(place.at("at"), message, hint=hint)


@cell_rule("GW804")
def device_is_no_owner(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An input of the robot that its device may not write."""
    writers = _writers(cell)
    for place in _inputs(cell):
        writer, lock = writers.get(place.name), place.variable.lock
        if writer is None or lock is None or writer in cell.locks[lock].owners:
            continue
        owned = cell.locks[lock]
        who = f"only {alternatives(owned.owners)}" if owned.owners else "nobody"
        message = f"`{place.variable.part.name}` comes from `{place.name}`, but {who} may write it"
        hint = f"write `owner: {writer}`, or a list by priority with `{writer}` in it"
        yield rule.at(owned.position, message, hint=hint, related=(Related(place.at("at"), "it lies here"),))


@cell_rule("GW805")
def output_in_read_only_table(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An output of the robot where nobody can write in the device."""
    for place in _outputs(cell):
        placed = placement_of(place)
        if placed is not None and placed.area in _READ_ONLY:
            key = _READ_ONLY[placed.area]
            message = (
                f"`{place.variable.part.name}` is an output of the robot, but nobody can "
                f"write {where(placed)} of `{place.name}`"
            )
            hint = f"write `{key}: N`, or map an input such as {place.variable.counterpart or 'input_int_register_0'}"
            yield rule.at(placed.position, message, hint=hint)


@cell_rule("GW806")
def output_overlap(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two outputs of the robot at the same place in a device."""
    spans: list[tuple[tuple[str, str, int], int, ExpandedPlace]] = []
    for place in devices_of(cell).places:
        placed = placement_of(place)
        if placed is None or placed.problem is not None or place.is_read:
            continue
        start = placed.address * 16 + placed.bits.start
        end = (placed.address + placed.words - 1) * 16 + placed.bits.stop
        spans.append(((place.name, placed.area.name, start), end, place))
    spans.sort(key=lambda span: (span[0], span[1]))
    for (first, end, one), ((name, area, start), _, other) in pairwise(spans):
        if first[:2] == (name, area) and start < end:
            earlier, later = sorted((one, other), key=lambda place: place.at())
            placed, met = placement_of(later), placement_of(earlier)
            assert placed is not None
            assert met is not None
            message = (
                f"`{later.variable.name}` is written to {where(placed)} of `{name}`, where "
                f"`{earlier.variable.name}` is"
            )
            related = (Related(met.position, f"`{earlier.variable.name}`, {where(met)}, first used here"),)
            yield rule.at(placed.position, message, hint="give one of the two another place", related=related)
            return


@cell_rule("GW807")
def rest_of_register(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An output with a part of a register, whose other bits are left open."""
    for place in _outputs(cell):
        placed = placement_of(place)
        if placed is not None and placed.bit is not None and place.spec.rest is None:
            message = (
                f"`{place.variable.part.name}` is written to {where(placed)} of "
                f"`{place.name}`, and the other bits are left open"
            )
            hint = "add `rest: keep`, which leaves them as they are in the device, or `rest: 0`"
            yield rule.at(placed.position, message, hint=hint)


@cell_rule("GW808")
def key_of_other_direction(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A key of outputs at an input, or of inputs at an output."""
    for place in _lines(cell):
        is_input = place.variable.direction is Direction.INPUT
        for key in ("on_connect", "every", "rest") if is_input else ("poll",):
            if key in place.spec.model_fields_set:
                kind = "read from" if is_input else "written to"
                message = f"`{place.variable.part.name}` is {kind} the device; `{key}` has no effect on it"
                yield rule.at(place.at(key), message, hint=f"remove `{key}`")


@cell_rule("GW819")
def input_twice_in_device(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An input of the robot that comes from two places of one device."""
    first: dict[tuple[int, str], ExpandedPlace] = {}
    for place in _inputs(cell):
        other = first.setdefault((place.variable.index, place.name), place)
        if other is not place and place.device is not None:
            message = (
                f"`{place.variable.part.name}` comes from two places in `{place.name}`, which may differ"
            )
            related = (Related(other.at(), "first placed here"),)
            yield rule.at(place.at(), message, hint="leave one of the two", related=related)


@cell_rule("GW822")
def rest_differs(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Outputs in one register of a device that disagree on its other bits."""
    first: dict[tuple[str, int], ExpandedPlace] = {}
    for place in devices_of(cell).places:
        placed = placement_of(place)
        if placed is None or placed.bit is None or place.is_read or place.spec.rest is None:
            continue
        other = first.setdefault((place.name, placed.address), place)
        if other.spec.rest != place.spec.rest:
            message = (
                f"`{place.variable.name}` and `{other.variable.name}` share a register, and "
                "say different things of its other bits"
            )
            related = (Related(other.at("rest"), f"`{other.variable.name}`"),)
            yield rule.at(place.at("rest"), message, hint="write the same `rest` at both", related=related)
            return


def _writers(cell: ExpandedCell) -> dict[str, str]:
    """Device -> writer that it is."""
    found: dict[str, str] = {}
    for writer in cell.document.writers.values():
        name = writer.spec.by(DeviceWriter).device
        if name is not None:
            found.setdefault(name, writer.name)
    return found


def _lines(cell: ExpandedCell) -> Iterator[ExpandedPlace]:
    """The first variable of each line: those of a family are alike in what these rules judge."""
    return (place for place in devices_of(cell).places if not place.variable.member)


def _inputs(cell: ExpandedCell) -> Iterator[ExpandedPlace]:
    return (place for place in _lines(cell) if place.is_read)


def _outputs(cell: ExpandedCell) -> Iterator[ExpandedPlace]:
    return (place for place in _lines(cell) if not place.is_read)
