"""Rules GW809 to GW811, GW814, GW816 to GW818, GW820, GW821 and GW823: what is declared of a device."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gatewayd.links.devices.expand import devices_of
from gatewayd.links.devices.language import lost_after, slowest_poll
from gatewayd.links.devices.sections import DeviceSpec, DeviceWriter
from gatewayd.links.devices.status_words import MAX_DEVICES
from gatewayd.links.registry import kinds
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule
from gatewayd.report.schema import taken_names
from gatewayd.report.wording import seconds

_OF_SERIAL: Final = ("baudrate", "parity", "stop_bits")
_OF_TCP: Final = ("framing", "connect", "in_flight")


@cell_rule("GW809")
def key_of_other_line(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A key of serial ports at a device reached by TCP, or the other way round."""
    for device in _devices(cell):
        is_serial = device.spec.selector == "serial"
        for key in _OF_TCP if is_serial else _OF_SERIAL:
            if key in device.spec.model_fields_set:
                line = "on a serial port" if is_serial else "reached by TCP"
                message = f"`{device.name}` is {line}; `{key}` has no effect on it"
                yield rule.at(device.key_at(key), message, hint=f"remove `{key}`")


@cell_rule("GW810")
def serial_without_baudrate(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A device on a serial port without its bit rate."""
    for device in _devices(cell):
        if device.spec.selector == "serial" and device.spec.baudrate is None:
            message = f"`{device.name}` is on a serial port, and its bit rate is not said"
            yield rule.at(
                device.at("serial"), message, hint="add for example `baudrate: 19200`, as the device has it"
            )


@cell_rule("GW811")
def in_flight_of_rtu(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Several requests at a time where answers do not say to which they belong."""
    for device in _devices(cell):
        if device.spec.framing == "rtu" and device.spec.in_flight > 1:
            message = (
                f"`{device.name}` is asked {device.spec.in_flight} things at a time, but "
                "frames of `rtu` have no number"
            )
            yield rule.at(device.at("in_flight"), message, hint="remove `in_flight`")


@cell_rule("GW814", Severity.WARNING)
def device_without_watchdog(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A device with outputs that does not say what it does when it is not asked."""
    written = {place.name for place in devices_of(cell).places if not place.is_read}
    for device in _devices(cell):
        if device.name in written and "watchdog" not in device.spec.model_fields_set:
            message = (
                f"`{device.name}` gets outputs, and keeps them for ever if it has no watchdog of its own"
            )
            hint = "set one up in the device and write `watchdog: 2s` with its time, or `watchdog: none` if it has none"
            yield rule.at(device.key, message, hint=hint)


@cell_rule("GW816")
def name_of_device(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A device with a name that stands for something else in what the gateway says."""
    taken = {*taken_names(has_places=True), *(kind.key for kind in kinds()), "cell"}
    for device in _devices(cell):
        if device.name in taken:
            message = f"`{device.name}` is a name that the gateway uses itself, beside those of devices"
            yield rule.at(
                device.key, message, hint="give the device another name, such as what it is: island, gripper"
            )


@cell_rule("GW817", Severity.WARNING)
def lost_between_two_polls(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A device that counts as lost before its next answer can come."""
    for device in _devices(cell):
        places = devices_of(cell).of(device.name)
        needed = slowest_poll(device.spec, places) + device.spec.timeout
        if lost_after(device.spec, places) < needed:
            message = (
                f"`{device.name}` is lost after {seconds(device.spec.lost_after or 0)}, but "
                f"an answer may take {seconds(needed)} with its poll"
            )
            yield rule.at(
                device.at("lost_after"),
                message,
                hint=f"write at least `lost_after: {seconds(2 * needed)}`, or poll faster",
            )
        for place in places:
            lock = place.variable.lock
            lease = cell.locks[lock].lease if place.is_read and lock is not None else None
            if lease is not None and lease < place.poll + device.spec.timeout:
                longest = place.poll + device.spec.timeout
                message = (
                    f"`{place.variable.part.name}` is lost after its lease of {seconds(lease)}, but an answer of "
                    f"`{device.name}` may take {seconds(longest)} with its poll"
                )
                hint = f"write at least `lease: {seconds(2 * longest)}`, or poll faster"
                yield rule.at(place.at(), message, hint=hint)


@cell_rule("GW818")
def two_writers_of_a_device(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A device that two writers are."""
    first: dict[str, str] = {}
    for writer in cell.document.writers.values():
        name = writer.spec.by(DeviceWriter).device
        if name is None:
            continue
        other = first.setdefault(name, writer.name)
        if other != writer.name:
            message = f"the writers `{other}` and `{writer.name}` are both the device `{name}`"
            related = (Related(cell.document.writers[other].key, f"`{other}`"),)
            yield rule.at(writer.at("device"), message, hint="leave one of the two", related=related)


@cell_rule("GW820", Severity.WARNING)
def idle_device(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A device in which nothing lies."""
    if len(cell.document.declared("variables")) != len(cell.document.variables):
        return
    used = {place.name for place in devices_of(cell).places}
    for device in _devices(cell):
        if device.name not in used:
            message = f"no variable lies in `{device.name}`"
            hint = f"place one in it, `device: {{at: {device.name}, coil: 0}}`, or remove it"
            yield rule.at(device.key, message, hint=hint)


@cell_rule("GW821", Severity.WARNING)
def watchdog_between_two_polls(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A device whose watchdog ends before it is asked again."""
    for device in _devices(cell):
        watchdog = device.spec.watchdog
        if watchdog is not None and watchdog <= device.spec.poll:
            message = (
                f"the watchdog of `{device.name}` ends after {seconds(watchdog)}, and it is "
                f"asked every {seconds(device.spec.poll)}"
            )
            yield rule.at(
                device.at("watchdog"),
                message,
                hint=f"poll faster, for example `poll: {seconds(watchdog / 4)}`",
            )


@cell_rule("GW823")
def too_many_devices(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """More devices than a cell can have."""
    for number, device in enumerate(_devices(cell)):
        if number == MAX_DEVICES:
            message = f"`{device.name}` is one device too many: a cell has {MAX_DEVICES} at most"
            yield rule.at(
                device.key, message, hint="make two cells of it, or reach several things through one device"
            )


def _devices(cell: ExpandedCell) -> Iterator[Part[DeviceSpec]]:
    yield from cell.document.parts(DeviceSpec).values()
