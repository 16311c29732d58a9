"""Rules GW830 to GW841, GW848 and GW849: objects of CANopen devices, their data sheets and PDOs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gatewayd.links.devices.canopen.expand import (
    DeviceLayout,
    ExpandedObject,
    ObjectProblem,
    lay_out,
    object_of,
    sheet_file,
)
from gatewayd.links.devices.canopen.managed_bus import bus_of
from gatewayd.links.devices.canopen.plan import TYPES, WORDS
from gatewayd.links.devices.expand import all_families, devices_of, family_of
from gatewayd.links.devices.places import ExpandedPlace
from gatewayd.links.devices.sections import DeviceSpec
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.report.format import counted
from gatewayd.report.wording import alternatives


@cell_rule("GW830")
def data_sheet_unreadable(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A data sheet that is not there or cannot be read."""
    for device in _devices(cell):
        found = sheet_file(cell.document, device)
        if found is not None and found.sheet is None:
            message = f"the data sheet {found.path} of `{device.name}` cannot be used: {found.problem}"
            hint = "put the EDS or DCF of the manufacturer beside this file, and name it as it is called"
            yield rule.at(device.at("eds"), message, hint=hint)


@cell_rule("GW831")
def object_not_in_data_sheet(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A place in an object that the data sheet of the device does not have."""
    for place, found in _wrong(cell, ObjectProblem.NO_OBJECT):
        message = f"the data sheet of `{place.name}` has no object {_at(found)}"
        yield rule.at(place.at("object"), message, hint=_others(cell, place, found))


@cell_rule("GW832")
def object_of_other_type(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An object whose type is not known, is no number, or is another one."""
    problems = (ObjectProblem.NO_TYPE, ObjectProblem.NO_NUMBER, ObjectProblem.OTHER_TYPE)
    for place, found in _wrong(cell, *problems):
        where = place.at("type" if place.spec.type is not None else "object")
        name = place.variable.part.name
        if found.problem is ObjectProblem.NO_TYPE:
            message = f"nobody says the type of {_at(found)}, where `{name}` lies"
            hint = f"name the data sheet (`eds:`) at `{place.name}`, or write `type:` with {alternatives([*TYPES])}"
        elif found.problem is ObjectProblem.NO_NUMBER:
            message = f"{_at(found)} of `{place.name}` is no number that a variable can have"
            hint = "map another object: integers of 8, 16, 32 and 64 bits, reals and BOOLEAN are numbers"
        else:
            has = WORDS[found.entry.type] if found.entry is not None and found.entry.type is not None else ""
            message = f"{_at(found)} is {has} by the data sheet of `{place.name}`, not {place.spec.type}"
            hint = "remove `type`"
        yield rule.at(where, message, hint=hint)


@cell_rule("GW833")
def object_wrongly_scaled(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An object with a scale of 0, or a scaled BOOLEAN."""
    for place, found in _wrong(cell, ObjectProblem.SCALE_OF_ZERO, ObjectProblem.SCALED_BOOLEAN):
        key = "scale" if place.spec.scale is not None else "offset"
        is_bit = found.problem is ObjectProblem.SCALED_BOOLEAN
        message = (
            f"{_at(found)} is a BOOLEAN, which has no scale and no offset"
            if is_bit
            else f"`{place.variable.part.name}` has a scale of 0: every number would mean the same"
        )
        yield rule.at(
            place.at(key), message, hint=f"remove `{key}`" if is_bit else "write the unit of the object"
        )


@cell_rule("GW834")
def object_of_other_direction(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An object that cannot be written for an output, or not be read for an input."""
    for place, found in _wrong(cell, ObjectProblem.READ_ONLY, ObjectProblem.WRITE_ONLY):
        name = place.variable.part.name
        if found.problem is ObjectProblem.READ_ONLY:
            message = f"`{name}` is an output of the robot, but {_at(found)} of `{place.name}` is read only"
        else:
            message = f"`{name}` is an input of the robot, but {_at(found)} of `{place.name}` is write only"
        counterpart = place.variable.counterpart
        hint = "map another object" + (
            f", or {counterpart} in place of {place.variable.target}" if counterpart else ""
        )
        yield rule.at(place.at("object"), message, hint=hint)


@cell_rule("GW835")
def object_not_mappable(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """An object in a PDO that cannot have it, or whose layout cannot be written."""
    for place in _lines(cell):
        found, order = object_of(place), place.spec.pdo
        if found is None or found.problem is not None or not isinstance(order, int) or place.device is None:
            continue
        label = f"{'TPDO' if place.is_read else 'RPDO'} {order}"
        entry = found.entry
        if entry is not None and not (entry.transmitted if place.is_read else entry.received):
            message = f"{_at(found)} of `{place.name}` cannot be in a {label.split(maxsplit=1)[0]} by its data sheet"
            yield rule.at(place.at("pdo"), message, hint="write `pdo: none`: it goes by SDO then")
            continue
        sheet = sheet_file(cell.document, place.device)
        if (
            sheet is not None
            and sheet.sheet is not None
            and sheet.sheet.is_fixed(order, transmit=place.is_read)
        ):
            message = f"the layout of {label} of `{place.name}` cannot be written, or there is no such PDO"
            hint = "remove `pdo`: the object goes in the PDO that has it, or by SDO"
            yield rule.at(place.at("pdo"), message, hint=hint)


@cell_rule("GW836")
def pdo_of_device_too_long(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A PDO of a device with more than 64 bits."""
    for device, layout in _layouts(cell):
        for pdo in layout.too_long:
            bits = sum(item.bits for item in pdo.objects)
            message = f"{pdo.label} of `{device.name}` would have {bits} bits, and a PDO has 64"
            where = _last_in(cell, device, pdo.number, transmit=pdo.transmit)
            yield rule.at(where.at("pdo"), message, hint=f"put some of them into PDO {pdo.number + 1}")


@cell_rule("GW837")
def pdo_without_cob_id(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A PDO of a device whose COB-ID nobody says."""
    for device, layout in _layouts(cell):
        for pdo in layout.without_cob_id:
            message = f"nobody says the COB-ID of {pdo.label} of `{device.name}`: only four have one from the node-ID"
            where = _last_in(cell, device, pdo.number, transmit=pdo.transmit)
            yield rule.at(
                where.at("pdo"), message, hint="use a PDO from 1 to 4, or a DCF that sets its COB-ID"
            )


@cell_rule("GW838", Severity.WARNING)
def device_without_heartbeat(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A CANopen device of which nobody says whether it has a heartbeat."""
    for device in _devices(cell):
        if "heartbeat" not in device.spec.model_fields_set:
            message = f"`{device.name}` sends no heartbeat unless it is told to: its loss is noticed late"
            hint = "write `heartbeat: 500ms`, or `heartbeat: none` for a device that has none"
            yield rule.at(device.key, message, hint=hint)


@cell_rule("GW839")
def object_written_twice(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two outputs of the robot in one object of a device."""
    first: dict[tuple[str, int, int], ExpandedPlace] = {}
    for place in devices_of(cell).places:
        found = object_of(place)
        if found is None or found.problem is not None or place.is_read:
            continue
        other = first.setdefault((place.name, found.index, found.subindex), place)
        if other is not place:
            known = other.variable.name
            message = (
                f"`{place.variable.name}` is written to {_at(found)} of `{place.name}`, where `{known}` is"
            )
            related = (Related(other.at("object"), f"`{known}`, first used here"),)
            yield rule.at(
                place.at("object"), message, hint="give one of the two another object", related=related
            )
            return


@cell_rule("GW840")
def place_of_other_family(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A register in a CANopen device, or an object in a Modbus device."""
    for place in _lines(cell):
        if place.device is None or place.where is not None:
            continue
        family = family_of(place.device.spec)
        if place.spec.selector not in family.place_selectors:
            message = f"`{place.name}` is reached by `{place.device.spec.selector}` and has no `{place.spec.selector}`"
            hint = f"write {{at: {place.name}, {family.place_example}}}"
            yield rule.at(place.at(place.spec.selector), message, hint=hint)


@cell_rule("GW841")
def key_of_other_family(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A key of CANopen devices at a Modbus device, or the other way round."""
    for device in cell.document.parts(DeviceSpec).values():
        own = family_of(device.spec)
        for family in all_families():
            for key in sorted((family.device_keys - own.device_keys) & device.spec.model_fields_set):
                if key in family.selectors:
                    continue
                message = (
                    f"`{device.name}` is reached by `{device.spec.selector}`; `{key}` has no effect on it"
                )
                yield rule.at(device.key_at(key), message, hint=f"remove `{key}`")
    for place in _lines(cell):
        if place.device is None or place.where is None:
            continue
        own = family_of(place.device.spec)
        for family in all_families():
            for key in sorted((family.place_keys - own.place_keys - _SHARED) & place.spec.model_fields_set):
                if key in family.place_selectors:
                    continue
                message = f"`{place.name}` is reached by `{place.device.spec.selector}`; `{key}` has no effect there"
                yield rule.at(place.at(key), message, hint=f"remove `{key}`")


@cell_rule("GW848")
def device_key_without_effect(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A key of a CANopen device that nothing in the file lets act."""
    for device, layout in _layouts(cell):
        spec, bus = device.spec, bus_of(cell.document, device.spec)
        written = any(pdo.written for pdo in (*layout.pdos, *layout.too_long, *layout.without_cob_id))
        idle = (
            (
                "keep",
                spec.heartbeat is None,
                "without a heartbeat nobody knows whether the device is in operation",
            ),
            (
                "manager",
                not bus.heartbeat,
                "the gateway has no heartbeat on the bus without `manager_heartbeat`",
            ),
            ("manager_heartbeat", bus.node is None, "a heartbeat needs the node-ID of its sender, `manager`"),
            ("transmission", not written, "the gateway lays out no PDO of it (`pdo: N`)"),
            ("event", not written, "the gateway lays out no PDO of it (`pdo: N`)"),
        )
        for key, has_none, reason in idle:
            if has_none and key in spec.model_fields_set and getattr(spec, key) not in (None, False):
                message = f"`{key}` of `{device.name}` has no effect: {reason}"
                yield rule.at(device.key_at(key), message, hint=f"remove `{key}`, or add what it needs")


@cell_rule("GW849", Severity.WARNING)
def sync_without_sender(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A PDO that waits for a SYNC which nobody is said to send."""
    for device, layout in _layouts(cell):
        waiting = [
            pdo
            for pdo in layout.pdos
            if pdo.transmission is not None and pdo.transmission <= _LAST_SYNCHRONOUS
        ]
        if waiting and not bus_of(cell.document, device.spec).sync.producer:
            message = f"{waiting[0].label} of `{device.name}` goes with SYNC, and the gateway sends none"
            hint = "add `sync: 10ms` to the devices of the bus, unless somebody else there sends it"
            key = "transmission" if "transmission" in device.spec.model_fields_set else "canopen"
            yield rule.at(device.at(key), message, hint=hint)


_LAST_SYNCHRONOUS = 240
"""Transmission types up to it are synchronous."""
_SHARED = frozenset({"type", "scale", "offset"})
"""Keys of a place that mean the same in all families."""


def _at(found: ExpandedObject) -> str:
    return f"{found.index:04X}h:{found.subindex:02X}"


def _others(cell: ExpandedCell, place: ExpandedPlace, found: ExpandedObject) -> str:
    """What the data sheet has instead."""
    assert place.device is not None
    file = sheet_file(cell.document, place.device)
    sheet = file.sheet if file is not None else None
    entries = [entry for entry in sheet.objects() if entry.index == found.index] if sheet is not None else []
    if entries:
        subs = ", ".join(str(entry.subindex) for entry in entries[:8])
        return f"write `sub:` with one of its sub-indices: {subs}" + (", ..." if len(entries) > 8 else "")
    device = [entry for entry in sheet.objects() if entry.index >= 0x2000] if sheet is not None else []
    count = counted(len(device), "object")
    return f"look into the data sheet: it has {count} of the device's own" + (
        f", the first is {device[0].text}" if device else ""
    )


def _devices(cell: ExpandedCell) -> Iterator[Part[DeviceSpec]]:
    return (device for device in cell.document.parts(DeviceSpec).values() if device.spec.canopen is not None)


def _lines(cell: ExpandedCell) -> Iterator[ExpandedPlace]:
    """The first variable of each line: those of a family are alike in what these rules judge."""
    return (place for place in devices_of(cell).places if not place.variable.member)


def _wrong(cell: ExpandedCell, *problems: ObjectProblem) -> Iterator[tuple[ExpandedPlace, ExpandedObject]]:
    """The first variable of each line that lies wrongly."""
    reported: set[tuple[str, int]] = set()
    for place in devices_of(cell).places:
        found, line = object_of(place), (place.variable.part.name, place.number)
        if found is not None and found.problem in problems and line not in reported:
            reported.add(line)
            yield place, found


def _layouts(cell: ExpandedCell) -> Iterator[tuple[Part[DeviceSpec], DeviceLayout]]:
    for device in _devices(cell):
        yield device, lay_out(cell.document, device, devices_of(cell).of(device.name))


def _last_in(cell: ExpandedCell, device: Part[DeviceSpec], order: int, *, transmit: bool) -> ExpandedPlace:
    """The last variable in a PDO that is laid out."""
    members: Mapping[int, ExpandedPlace] = dict(
        enumerate(
            place
            for place in devices_of(cell).of(device.name)
            if place.spec.pdo == order and place.is_read is transmit and object_of(place) is not None
        )
    )
    return members[len(members) - 1]
