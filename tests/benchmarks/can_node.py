"""A CANopen node at the end of a pair of sockets, as a process: gatewayd's, or one on python-canopen's LocalNode.

Arguments: the number of the socket, and `gatewayd` or `canopen`. The sockets carry SocketCAN's frames, so that both
run the code that they run on SocketCAN. Lines on standard input are orders: `report` prints frames received and CPU
seconds used; `transmit KIND COUNT` changes values and sends them COUNT times, `receive KIND COUNT` hands so many RPDOs
with new values to the node without a bus, and both print the CPU seconds that took. It is run as a file, so that it
measures the gatewayd of whatever interpreter runs it.
"""

from __future__ import annotations

import asyncio
import io
import socket
import struct
import sys
import time
from collections.abc import Callable
from typing import Any, cast

import can
import canopen
from can.interfaces.socketcan import socketcan as stock_socketcan

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.socketcan import SocketCanBus
from gatewayd.canopen.supervision import BusSignal
from gatewayd.core.cell import Cell
from gatewayd.links.canopen_node import runtime as link_module
from gatewayd.links.canopen_node.eds import eds_text, objects_of, sheet_of
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.canopen_node.runtime import CanLink
from gatewayd.links.canopen_node.store import Store
from gatewayd.mapping.loader import load

NODE = 5
MAPPING = """\
gatewayd: 1
cell: bench
robot: {host: 127.0.0.1, frequency: 50, stale_after: 60s}
canopen: {channel: bench, bitrate: 1000000, node: 5, autostart: true, heartbeat: none}
writers: {master: {canopen: any}}
variables:
  bits_in:    {robot: input_bit_register_0..63,   canopen: auto, lease: none}
  ints_in:    {robot: input_int_register_0..1,    canopen: auto, lease: none}
  bits_out:   {robot: output_bit_register_0..63,  canopen: auto}
  ints_out:   {robot: output_int_register_0..3,   canopen: auto}
"""
BITS, INTEGERS, SYNCHRONOUS = 1, 2, 3
"""PDOs: 64 bits, two integers, two integers with SYNC."""
COB_IDS = {BITS: 0x200 + NODE, INTEGERS: 0x300 + NODE}
"""Of the RPDOs."""
TICK = 0.02


def _plan() -> Any:
    loaded = load(MAPPING.encode(), "bench.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


class PairBus(SocketCanBus):
    """The fast path on a socket that is there already."""

    def __init__(self, pair: socket.socket, handler: CanLink) -> None:
        super().__init__("bench", handler)
        self._pair = pair

    async def open(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._pair.setblocking(False)
        self._socket = self._pair
        self._loop.add_reader(self._pair, self._readable)
        self._feed(BusSignal.ACTIVE, time.monotonic(), "a pair of sockets")

    def set_filters(self, can_ids: Any, remote_ids: Any = ()) -> None:
        """The other end sends what this one listens to."""


class Gateway:
    """A cell with its link; the robot is a list of values."""

    link: CanLink

    def __init__(self, pair: socket.socket) -> None:
        plan = _plan()
        self.cell = Cell(plan.cell)
        setattr(link_module, "make_bus", lambda *_: PairBus(pair, self.link))  # noqa: B010 - mypy refuses the other way
        self.link = CanLink(plan.the(CanopenPlan), self.cell, Store())
        self.names = {one.name: index for index, one in enumerate(plan.cell.variables)}

    async def run(self) -> None:
        now = time.monotonic()
        self.cell.robot_connected(now)
        inputs = [index for name, index in self.names.items() if "_in" in name]
        self.cell.adopt(dict.fromkeys(inputs, 0), now)
        self.cell.package_arrived(1.0, now)
        self.cell.outputs_written(now)
        running = asyncio.create_task(self.link.run())
        await asyncio.sleep(0)
        asyncio.get_running_loop().add_reader(sys.stdin, self._order)
        print("ready", flush=True)
        try:
            while True:
                now = time.monotonic()
                self.cell.package_arrived(now, now)
                self.cell.tick(now)
                await asyncio.sleep(TICK)
        finally:
            running.cancel()

    def _order(self) -> None:
        line = sys.stdin.readline()
        if not line:
            raise SystemExit
        _obey(line, self.received, {"transmit": self.transmit, "receive": self.receive})

    def received(self) -> int:
        return self.link.node.counters.received

    def receive(self, kind: int, count: int) -> None:
        """As the driver does it, with frames of which each has other values than the one before."""
        can_id, now = COB_IDS[kind], time.monotonic()
        for number in range(1, count + 1):
            self.link.node.receive(Frame(can_id, struct.pack("<ii", number, -number)), now)

    def transmit(self, kind: int, count: int) -> None:
        """As the robot's link does it: values into the image, one notice."""
        values, first = self.cell.image.values, self.names["bits_out[0]" if kind == BITS else "ints_out[0]"]
        width = 64 if kind == BITS else 2
        for number in range(1, count + 1):
            if kind == BITS:
                values[first : first + width] = [bool((number + bit) & 1) for bit in range(width)]
            else:
                values[first : first + width] = [number, -number]
            self.cell.outputs_written(time.monotonic())


class Stock:
    """What python-canopen's documentation suggests: a LocalNode, callbacks, `.raw`, and `transmit`."""

    def __init__(self, pair: socket.socket) -> None:
        plan = _plan()
        sheet = io.StringIO(
            eds_text(objects_of(plan.the(CanopenPlan), plan.cell), sheet_of(plan.the(CanopenPlan), plan.cell))
        )
        sheet.name = "bench.eds"
        setattr(stock_socketcan, "create_socket", lambda: pair)  # noqa: B010
        setattr(stock_socketcan, "bind_socket", lambda *_: None)  # noqa: B010
        self.count = 0
        self.network = cast("Any", canopen.Network())
        self.network.connect(interface="socketcan", channel="bench", receive_own_messages=False)
        self.node: Any = self.network.create_node(NODE, canopen.import_od(sheet, NODE))
        self.node.tpdo.read()
        self.node.rpdo.read()
        for kind in (BITS, INTEGERS):
            self.node.rpdo[kind].add_callback(self._receive)
        self.network.subscribe(0x80, self._sync)
        self.state = [0, 0]

    def _receive(self, pdo: Any) -> None:
        self.state[:2] = [one.raw for one in pdo.map][:2]
        self.count += 1

    def _sync(self, *_: Any) -> None:
        pdo = self.node.tpdo[SYNCHRONOUS]
        pdo.map[0].raw, pdo.map[1].raw = self.state
        pdo.transmit()

    def transmit(self, kind: int, count: int) -> None:
        pdo = self.node.tpdo[kind]
        variables = list(pdo.map)
        for number in range(1, count + 1):
            if kind == BITS:
                for bit, one in enumerate(variables):
                    one.raw = bool((number + bit) & 1)
            else:
                variables[0].raw, variables[1].raw = number, -number
            pdo.transmit()

    def run(self) -> None:
        print("ready", flush=True)
        for line in sys.stdin:
            _obey(line, lambda: self.count, {"transmit": self.transmit})


def _obey(line: str, received: Callable[[], int], orders: dict[str, Callable[[int, int], None]]) -> None:
    order, *arguments = line.split()
    if order in orders:
        begin = time.process_time()
        orders[order](int(arguments[0]), int(arguments[1]))
        print(time.process_time() - begin, flush=True)
    else:
        print(received(), time.process_time(), flush=True)


def main() -> None:
    pair = socket.socket(fileno=int(sys.argv[1]))
    can.log.setLevel("CRITICAL")  # it cannot set options of CAN sockets on these
    if sys.argv[2] == "gatewayd":
        asyncio.run(Gateway(pair).run())
    else:
        Stock(pair).run()


if __name__ == "__main__":
    main()
