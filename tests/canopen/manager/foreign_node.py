"""A CANopen device by somebody else as a program of its own: python-canopen's LocalNode, or a node of durand.

Arguments: `canopen` or `durand`, interface and channel of python-can, node-ID. Each line on standard input is a JSON
list of a command and its arguments, and has one line of JSON as its answer.
"""

from __future__ import annotations

import asyncio
import io
import json
import sys
from typing import Any, cast

import can

from tests.canopen.manager.sheets import DEVICE

VENDOR, PRODUCT = 0x1F0, 0x401
BIT_RATE = 500_000


def _bus(interface: str, channel: str) -> can.BusABC:
    options: dict[str, Any] = {"sleep_after_open": 0, "bitrate": BIT_RATE} if interface == "slcan" else {}
    return can.Bus(channel, interface=interface, **options)


class Canopen:
    """LocalNode, with what an application has to add to it: the boot-up message after a reset, and its TPDO."""

    def __init__(self, interface: str, channel: str, node: int) -> None:
        import canopen

        sheet = io.StringIO(DEVICE)
        sheet.name = "device.eds"
        self._network: Any = canopen.Network(_bus(interface, channel))
        self._network.NOTIFIER_CYCLE = 0.01
        self._network.connect()
        made = canopen.LocalNode(node, canopen.import_od(sheet, node))
        self._node = cast("Any", self._network.create_node(cast("Any", made)))
        self._node.rpdo.read(from_od=True)
        self._node.tpdo.read(from_od=True)
        self._node.rpdo[1].add_callback(self._take)
        self._node.add_write_callback(self._written)
        self._network.subscribe(0, self._commanded)
        self.boot()

    def boot(self) -> None:
        self._node.nmt.state = "INITIALISING"
        self._node.nmt.state = "PRE-OPERATIONAL"

    def set(self, index: int, subindex: int, value: int) -> None:
        found = self._node.sdo[index]
        (found[subindex] if hasattr(found, "values") else found).raw = value
        if index == 0x6004:
            self._node.tpdo[1][0].raw = value
            if self._node.nmt.state == "OPERATIONAL":
                self._node.tpdo[1].transmit()

    def get(self, index: int, subindex: int) -> int:
        found = self._node.sdo[index]
        return int((found[subindex] if hasattr(found, "values") else found).raw)

    def emcy(self, code: int, register: int, data: str) -> None:
        self._node.emcy.send(code, register, bytes.fromhex(data))

    def state(self) -> str:
        return str(self._node.nmt.state)

    def _take(self, pdo: Any) -> None:
        self._node.sdo[0x6200].raw = pdo[0].raw

    def _written(self, index: int, **_: Any) -> None:
        if 0x1800 <= index < 0x1C00:
            self._node.tpdo.read(from_od=False)

    def _commanded(self, _can_id: int, data: bytearray, _moment: float) -> None:
        if data[0] in (129, 130) and data[1] in (0, self._node.id):
            self.boot()


class Durand:
    """A node of durand, on an event loop that runs while a line is waited for."""

    def __init__(self, interface: str, channel: str, node: int) -> None:
        from durand import CANBusNetwork, MinimalNode, Variable
        from durand.datatypes import DatatypeEnum

        self._bus = _bus(interface, channel)
        self._node = MinimalNode(CANBusNetwork(self._bus, loop=asyncio.get_running_loop()), node)
        objects = self._node.object_dictionary
        objects[0x2000] = Variable(DatatypeEnum.UNSIGNED16, "rw", 0)
        objects[0x6004] = Variable(DatatypeEnum.UNSIGNED32, "ro", 0)
        objects[0x6200] = Variable(DatatypeEnum.UNSIGNED8, "rw", 0)
        objects.write(0x1000, 0, 0x20196)
        objects.write(0x1018, 1, VENDOR)
        objects.write(0x1018, 2, PRODUCT)
        self._node.tpdo[0].mapping = [(0x6004, 0)]
        self._node.rpdo[0].mapping = [(0x6200, 0)]
        self._node.nmt.reset()

    def boot(self) -> None:
        self._node.nmt.reset()

    def set(self, index: int, subindex: int, value: int) -> None:
        self._node.object_dictionary.write(index, subindex, value)

    def get(self, index: int, subindex: int) -> int:
        return int(self._node.object_dictionary.read(index, subindex))

    def emcy(self, code: int, register: int, data: str) -> None:
        self._node.emcy.set(code, register, bytes.fromhex(data))

    def state(self) -> str:
        return str(self._node.nmt.state.name).replace("_", "-")


async def main() -> None:
    kind, interface, channel, number = sys.argv[1:]
    node: Any = {"canopen": Canopen, "durand": Durand}[kind](interface, channel, int(number))
    print("booted", flush=True)
    loop = asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        command, *arguments = json.loads(line)
        print(json.dumps(getattr(node, command)(*arguments)), flush=True)


if __name__ == "__main__":
    asyncio.run(main())
