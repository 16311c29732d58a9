"""Cells with CANopen devices, and the devices: nodes of durand on a virtual bus of the loop."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import can
from durand import MinimalNode, Variable
from durand.datatypes import DatatypeEnum
from durand.network import NetworkABC

from gatewayd.core.cell import Cell
from gatewayd.links.devices.canopen.buses import CanopenBuses
from gatewayd.links.devices.canopen.link import CanopenDeviceLink
from gatewayd.links.devices.canopen.plan import CanopenDevicePlan
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

SHEET = Path(__file__).parents[4] / "gatewayd" / "links" / "devices" / "rules" / "device.eds"
"""The data sheet of the rules' examples."""
HEAD = """\
gatewayd: 1
cell: press
robot: {{host: 127.0.0.1}}
modbus: {{listen: '127.0.0.1:1502', allow: 127.0.0.1}}
devices:
  encoder: {{canopen: {channel}, interface: virtual, node: 5, eds: {sheet}, heartbeat: {heartbeat}, poll: 20ms,
    watchdog: none{more}}}
writers:
  encoder: {{device: encoder}}
  plc: {{modbus: 127.0.0.1, timeout: 1s}}
variables:
"""
VARIABLES = """\
  position: {robot: input_double_register_0, device: {at: encoder, object: 0x6004, scale: 0.001}, owner: encoder}
  preset: {robot: input_int_register_1, device: {at: encoder, object: 0x2000}, owner: encoder}
  clamp: {robot: output_int_register_2, device: {at: encoder, object: 0x6200, sub: 1}, limits: [0, 255]}
  speed: {robot: output_int_register_3, device: {at: encoder, object: 0x2002, on_connect: write}, limits: [0, 65535]}
"""
VENDOR = 0x1F0


def text(variables: str = VARIABLES, channel: str = "can1", more: str = "", heartbeat: str = "9s") -> str:
    """A mapping file."""
    return HEAD.format(channel=channel, sheet=SHEET, more=more, heartbeat=heartbeat) + variables


def planned(variables: str = VARIABLES, channel: str = "can1", more: str = "", heartbeat: str = "9s") -> Plan:
    """The plan of a mapping without errors."""
    found = load(text(variables, channel, more, heartbeat).encode(), "press.yaml")
    assert [each.message for each in found.errors] == []
    assert found.plan is not None
    return found.plan


def the_device(plan: Plan, name: str = "encoder") -> CanopenDevicePlan:
    """One of its devices."""
    return plan.of(CanopenDevicePlan)[name]


class LoopNetwork(NetworkABC):  # type: ignore[misc]  # durand has no types
    """What a node of durand needs of a bus, in the loop: durand's own has a thread that outlives it for a second."""

    def __init__(self, channel: str) -> None:
        self.silent = False
        self._bus = can.Bus(channel, interface="virtual")
        self._callbacks: dict[int, Callable[[int, bytes], None]] = {}
        self._task = asyncio.create_task(self._read())

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        self._callbacks[cob_id] = callback

    def remove_subscription(self, cob_id: int) -> None:
        del self._callbacks[cob_id]

    def send(self, cob_id: int, msg: bytes) -> None:
        if not self.silent:
            self._bus.send(can.Message(arbitration_id=cob_id, data=msg, is_extended_id=False))

    def close(self) -> None:
        self._task.cancel()
        self._bus.shutdown()

    async def _read(self) -> None:
        while True:
            while (message := self._bus.recv(0)) is not None:
                callback = self._callbacks.get(message.arbitration_id)
                if callback is not None and not self.silent:
                    callback(message.arbitration_id, bytes(message.data))
            await asyncio.sleep(0.001)


class Encoder:
    """A device as its data sheet describes it."""

    def __init__(self, network: LoopNetwork) -> None:
        self.network = network
        self.node: Any = MinimalNode(network, 5)
        objects = self.node.object_dictionary
        objects[0x2000] = Variable(DatatypeEnum.UNSIGNED16, "rw", 41)
        objects[0x2002] = Variable(DatatypeEnum.UNSIGNED16, "wo", 0)
        objects[0x6004] = Variable(DatatypeEnum.UNSIGNED32, "ro", 1500)
        outputs = self._record()
        outputs[1] = Variable(DatatypeEnum.UNSIGNED8, "rw", 0)
        objects[0x6200] = outputs
        objects.write(0x1000, 0, 0x20196)
        objects.write(0x1018, 1, VENDOR)
        objects.write(0x1018, 2, 0x401)
        self.node.tpdo[0].mapping = [(0x6004, 0)]
        self.node.rpdo[0].mapping = [(0x6200, 1)]

    @staticmethod
    def _record() -> Any:
        from durand import Record

        return Record()

    def get(self, index: int, subindex: int = 0) -> int:
        return int(self.node.object_dictionary.read(index, subindex))

    def set(self, index: int, value: int, subindex: int = 0) -> None:
        self.node.object_dictionary.write(index, subindex, value)


@asynccontextmanager
async def an_encoder(channel: str) -> AsyncIterator[Encoder]:
    """A device that is switched on."""
    network = LoopNetwork(channel)
    yield Encoder(network)
    network.close()


@asynccontextmanager
async def managed(links: list[CanopenDeviceLink]) -> AsyncIterator[CanopenBuses]:
    """Buses that serve these links, with everything at work."""
    buses = CanopenBuses()
    tasks = [asyncio.create_task(buses.run()), *(asyncio.create_task(link.run()) for link in links)]
    await asyncio.sleep(0)
    buses.serve(links, {})
    yield buses
    await buses.close()
    for task in tasks:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


def link_of(plan: Plan, cell: Cell) -> CanopenDeviceLink:
    """The link to its encoder."""
    return CanopenDeviceLink(the_device(plan), cell)


def expanded(variables: str, more: str = "") -> ExpandedCell:
    """A cell with these variables."""
    found = load(text(variables, more=more).encode(), "press.yaml")
    assert found.cell is not None
    return found.cell


def line(name: str, robot: str, place: str) -> str:
    """One variable."""
    owner = ", owner: encoder" if robot.startswith("input") else ""
    return f"  {name}: {{robot: {robot}, device: {{at: encoder, {place}}}{owner}}}\n"
