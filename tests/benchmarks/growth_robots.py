"""Controllers of many cells in one process, cheaper than as many simulators: `growth_robots.py COUNT PORT FREQUENCY`.

Controller n listens on `host(n)`. Its packages come regularly, those of the others between them. Every output double of
a package is the moment when it was sent, by the clock of this machine; what is written is read back.
"""

from __future__ import annotations

import selectors
import socket
import sys
import time

from gatewayd.rtde.messages import DataPackage
from gatewayd.rtde.recipe import Scalar
from tests.benchmarks.controller import Session

CLOCKS = tuple(f"output_double_register_{number}" for number in range(24))


def host(number: int) -> str:
    """The loopback address of a controller; two cells may not write to one robot."""
    return f"127.0.1.{number + 1}"


class _Robot:
    """One client's connection, and the values of its next package."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.session = Session(connection)
        self._flat: list[Scalar] = []
        self._clocks: list[int] = []

    def take(self, data: bytes) -> None:
        arrived = self.session.take(data)
        output = self.session.output
        if output is None:
            return
        if not self._flat:
            self._flat = [0] * sum(kind.count for kind in output.types)
            names = ("timestamp", *CLOCKS)
            self._clocks = [output.slots[name].start for name in names if name in output.slots]
        for values in arrived:
            for name, value in values.items():
                if name in output.slots:
                    self._flat[output.slots[name]] = value

    def send(self, now: float) -> None:
        output = self.session.output
        if not self.session.started or output is None:
            return
        for place in self._clocks:
            self._flat[place] = now
        self.connection.sendall(self.session.protocol.send(DataPackage(1, output.pack(self._flat))))


def _serve(count: int, port: int, frequency: float) -> None:
    selector = selectors.DefaultSelector()
    robots: dict[int, _Robot] = {}
    for number in range(count):
        selector.register(socket.create_server((host(number), port)), selectors.EVENT_READ, number)
    slot = 1 / (frequency * count)
    due, turn = time.monotonic(), 0
    print("listening", flush=True)
    while True:
        for key, _ in selector.select(max(0.0, due - time.monotonic())):
            source = key.fileobj
            assert isinstance(source, socket.socket)
            if isinstance(key.data, int):
                connection, _ = source.accept()
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                robots[key.data] = _Robot(connection)
                selector.register(connection, selectors.EVENT_READ, robots[key.data])
            elif data := source.recv(65536):
                key.data.take(data)
            else:
                selector.unregister(source)
                robots = {number: robot for number, robot in robots.items() if robot is not key.data}
        while due <= time.monotonic():
            if turn in robots:
                robots[turn].send(time.monotonic())
            turn = (turn + 1) % count
            due += slot


if __name__ == "__main__":
    _serve(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
