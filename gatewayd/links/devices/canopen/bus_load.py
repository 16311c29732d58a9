"""How much of a CAN bus a managed device takes in the worst case.

Counted is what goes on without anybody asking, as for the gateway's own node: PDOs in both directions, heartbeats; and
the reads by SDO that the manager repeats. All PDOs are taken at their greatest rate: with each SYNC, or one after the
other at their inhibit time, or without one as often as the robot reports and takes values.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import ceil
from typing import Final

from gatewayd.canopen.load import Share, frame_bits
from gatewayd.canopen.manager.plan import ManagedPdo, ManagerPlan
from gatewayd.links.devices.canopen.expand import DeviceLayout, lay_out, object_of
from gatewayd.links.devices.canopen.managed_bus import BEATS, bus_of
from gatewayd.links.devices.places import ExpandedPlace
from gatewayd.links.devices.sections import DeviceSpec
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell

FIRST_EVENT_TYPE: Final = 254
"""Transmission types below are synchronous."""
_SDO: Final = frame_bits(8)


def device_shares(
    cell: ExpandedCell, device: Part[DeviceSpec], places: Sequence[ExpandedPlace]
) -> Iterator[Share]:
    """What a device and the manager exchange without being asked."""
    spec, name = device.spec, f"device {device.name}"
    layout = lay_out(cell.document, device, places)
    bus = bus_of(cell.document, spec)
    for pdo in layout.pdos:
        bits = frame_bits(ceil(sum(item.bits for item in pdo.objects) / 8))
        yield Share(f"{name}: {pdo.label}", bits, _rate(pdo, bus, cell.settings.rate))
    if spec.heartbeat is not None:
        yield Share(f"{name}: heartbeat", frame_bits(1), BEATS / spec.heartbeat)
    yield from _reads(name, layout, places)


def manager_shares(bus: ManagerPlan) -> Iterator[Share]:
    """What the manager of a bus sends by itself."""
    if bus.sync.period:
        yield Share("SYNC", frame_bits(0), 1e6 / bus.sync.period)
    if bus.heartbeat and bus.node is not None:
        yield Share("the manager: heartbeat", frame_bits(1), 1000 / bus.heartbeat)


def _rate(pdo: ManagedPdo, bus: ManagerPlan, robot: float) -> float:
    if pdo.transmission is not None and pdo.transmission < FIRST_EVENT_TYPE:
        return min(1e6 / bus.sync.period, robot) if bus.sync.period else robot
    spacing = pdo.inhibit / 10_000 if pdo.inhibit else pdo.spacing
    return min(robot, 1 / spacing) if spacing else robot


def _reads(name: str, layout: DeviceLayout, places: Sequence[ExpandedPlace]) -> Iterator[Share]:
    for number, place in enumerate(places):
        found = object_of(place)
        if found is None or not place.is_read or number in layout.carried:
            continue
        # A request and its answer; what has more than four bytes takes one more of both for each seven.
        pairs = 1 if found.type.bits <= 32 else 1 + ceil(found.type.bits / 56)
        yield Share(f"{name}: reads of {found.index:04X}h", 2 * pairs * _SDO, 1 / place.poll)
