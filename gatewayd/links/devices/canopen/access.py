"""CANopen devices without a gateway: who answers on a bus, and an object of one device. It sends SDO requests only."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Sequence
from typing import Final

from gatewayd.canopen.bus import BusError
from gatewayd.canopen.manager.direct import BusAway, DirectBus
from gatewayd.core.definition import CellDefinition
from gatewayd.links.access import (
    AccessError,
    AccessProblem,
    DeviceAccess,
    FoundDevice,
    PlaceAnswer,
    PlaceRequest,
    Scan,
    ScanOrder,
)
from gatewayd.links.devices.asking import RunningDevice, running_devices
from gatewayd.links.devices.canopen.asking import ask_object
from gatewayd.links.devices.canopen.figures import identity_text
from gatewayd.links.devices.canopen.plan import CanopenDevicePlan
from gatewayd.links.examination import RunningCell
from gatewayd.mapping.plan import LinkPlan

DEFAULT_TIMEOUT: Final = 0.5
"""Seconds for each node that a scan asks."""
DEFAULT_BITRATE: Final = 500_000
_NODES: Final = range(1, 128)
_AT_A_TIME: Final = 16
"""Nodes that are asked together: each has a channel of its own."""
_IDENTITY: Final = (1, 2, 3, 4)
"""Sub-indices of 1018h: vendor, product, revision, serial number."""
_NAMES: Final = ("device_type", "vendor", "product", "revision", "serial_number")
_CHANNEL: Final = re.compile(r"(?:v|vx|sl)?can[0-9]{1,3}")
"""What interfaces of the kernel are usually called."""
SOCKETCAN: Final = "socketcan"


class CanopenScan(Scan):
    """The nodes of one bus."""

    asked = "the device type (1000h) and the identity (1018h)"
    noun = "node"

    def __init__(self, interface: str, channel: str, bitrate: int, nodes: range, timeout: float) -> None:
        self.line = channel if interface == SOCKETCAN else f"{interface}:{channel}"
        self.numbers = nodes
        self.longest = 2.0 + -(-len(nodes) // _AT_A_TIME) * timeout
        self._bus = interface, channel, bitrate
        self._timeout = timeout

    def refusal(self, running: Sequence[RunningCell]) -> str:
        """A node has one SDO client at a time."""
        for device in _on_bus(*self._bus[:2], running):
            return (
                f"{device.words} manages that bus, and both would ask the same nodes: stop that gateway first, or ask "
                f"one device through it: gatewayd devices read {device.name} 0x1018:1"
            )
        return ""

    def remarks(self, running: Sequence[RunningCell]) -> Sequence[str]:
        """Where the gateway is a node, somebody else is the master."""
        channel = ":".join(self._bus[:2])
        nodes = [
            cell for cell in running for link in cell.links("CANopen node") if link.get("channel") == channel
        ]
        return [
            f"the gateway at {cell.socket} (cell {cell.name}) is a node of that bus: its master may be disturbed where "
            "it asks the same nodes by SDO"
            for cell in nodes[:1]
        ]

    async def run(self) -> AsyncIterator[FoundDevice | int]:
        """See Scan."""
        interface, channel, bitrate = self._bus
        try:
            async with DirectBus(interface, channel, bitrate, self._timeout) as bus:
                for first in range(0, len(self.numbers), _AT_A_TIME):
                    nodes = self.numbers[first : first + _AT_A_TIME]
                    for found in await asyncio.gather(*(_ask(bus, node) for node in nodes)):
                        if found is not None:
                            yield found
                    yield first + len(nodes)
        except (BusAway, BusError) as error:
            raise AccessError(AccessProblem.UNUSABLE, f"{self.line}: {error}") from error


async def _ask(bus: DirectBus, node: int) -> FoundDevice | None:
    """A node as it describes itself; None: it does not answer. An abort is an answer."""
    kind = await bus.transfer(node, 0x1000, 0)
    if kind.silent:
        return None
    found = {0: _number(kind.data)} if kind.good else {}
    for subindex in _IDENTITY:
        result = await bus.transfer(node, 0x1018, subindex)
        if result.silent:
            break
        if result.good:
            found[subindex] = _number(result.data)
    fields = {name: found.get(subindex) for subindex, name in enumerate(_NAMES)}
    return FoundDevice(node, identity_text(found), fields)


def _number(data: bytes) -> int:
    return int.from_bytes(data[:4], "little")


class CanopenAccess(DeviceAccess):
    """Buses of the kernel, and other interfaces of python-can."""

    settings = ("interface", "bitrate")

    def takes(self, order: ScanOrder) -> bool:
        """See DeviceAccess."""
        return order.settings.get("interface") is not None or _CHANNEL.fullmatch(order.line) is not None

    def scan(self, order: ScanOrder) -> CanopenScan:
        """See DeviceAccess."""
        first = order.first if order.first is not None else _NODES[0]
        last = order.last if order.last is not None else _NODES[-1]
        if not (first in _NODES and last in _NODES and first <= last):
            raise AccessError(
                AccessProblem.BAD_PLACE, f"{first}..{last} are no node-IDs: they go from 1 to 127"
            )
        timeout = order.timeout if order.timeout is not None else DEFAULT_TIMEOUT
        interface = str(order.settings.get("interface") or SOCKETCAN)
        bitrate = int(str(order.settings.get("bitrate") or DEFAULT_BITRATE))
        return CanopenScan(interface, order.line, bitrate, range(first, last + 1), timeout)

    def refusal(self, plan: LinkPlan, running: Sequence[RunningCell]) -> str:
        """A node has one SDO client at a time."""
        assert isinstance(plan, CanopenDevicePlan)
        for device in _on_bus(plan.bus.interface, plan.bus.channel, running):
            return f"{device.words} manages that bus: ask through that gateway, without --mapping"
        return ""

    async def ask(self, plan: LinkPlan, cell: CellDefinition, request: PlaceRequest) -> PlaceAnswer:
        """See DeviceAccess."""
        assert isinstance(plan, CanopenDevicePlan)
        bus, node = plan.bus, plan.node
        try:
            async with DirectBus(bus.interface, bus.channel, bus.bitrate, node.sdo_timeout) as direct:
                return await ask_object(
                    plan, cell, request, lambda index, sub, data: direct.transfer(node.node, index, sub, data)
                )
        except (BusAway, BusError) as error:
            raise AccessError(AccessProblem.UNUSABLE, f"{bus.channel}: {error}") from error


def _on_bus(interface: str, channel: str, running: Sequence[RunningCell]) -> list[RunningDevice]:
    """Devices of running gateways on the same bus."""
    return [
        device
        for device in running_devices(running, CanopenDevicePlan.family)
        if device.status.get("address") == f"{interface}:{channel}"
    ]


ACCESS: Final = CanopenAccess()
"""Talks to devices of this family."""
