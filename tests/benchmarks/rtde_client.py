"""RTDE clients that are compared: `python rtde_client.py TASK KIND HOST PORT NAME...`.

TASK `read`: receive every package, look at the first eight fields, until stopped. TASK `loop`: write numbers into
`input_int_register_18`, each as soon as `output_int_register_18` shows the one before; after as many as the only NAME
says prints a line for each: cycles of the controller, and seconds, until it was seen.

KIND `gatewayd`, `gatewayd.sync` and `ur_rtde` are these; `official` is a client in the style of the one that Universal
Robots publishes: an object for each package, to which each field is given by itself.
"""

from __future__ import annotations

import asyncio
import select
import socket
import struct
import sys
import time
from collections.abc import Callable

from gatewayd import rtde
from gatewayd.rtde import sync

LOOKED_AT = 8
REGISTER = 18
"""One that every client can write and read: ur_rtde writes 18 to 22 of the lower ones, and reads 12 to 19."""
CYCLE = 0.002

# -- every package -----------------------------------------------------------------------------------------------------


def read_gatewayd(host: str, port: int, *names: str) -> None:
    """`gatewayd.rtde`, by its asynchronous iterator."""

    async def main() -> None:
        async with rtde.connect(host, port=port, outputs=names, strict=False) as robot:
            looked_at = names[:LOOKED_AT]
            async for sample in robot:
                for name in looked_at:
                    getattr(sample, name)

    asyncio.run(main())


def read_blocking(host: str, port: int, *names: str) -> None:
    """`gatewayd.rtde.sync`, by its blocking iterator."""
    looked_at = names[:LOOKED_AT]
    with sync.connect(host, port=port, outputs=names, strict=False) as robot:
        for sample in robot:
            for name in looked_at:
                getattr(sample, name)


FORMATS = {
    "BOOL": (">B", 1),
    "UINT8": (">B", 1),
    "INT32": (">i", 1),
    "UINT32": (">I", 1),
    "UINT64": (">Q", 1),
}
FORMATS |= {"DOUBLE": (">d", 1), "VECTOR3D": (">3d", 3), "VECTOR6D": (">6d", 6)}
FORMATS |= {"VECTOR6INT32": (">6i", 6), "VECTOR6UINT32": (">6I", 6)}


class Package:
    """Whatever fields it is given."""


class OfficialStyle:
    """One connection; blocking, with select() before each read."""

    def __init__(self, host: str, port: int, names: tuple[str, ...]) -> None:
        self.socket = socket.create_connection((host, port))
        self.buffer = b""
        self.names = names
        self.ask(86, struct.pack(">H", 2))
        answer = self.ask(79, struct.pack(">d", 500) + ",".join(names).encode())
        self.types = answer[1:].decode().split(",")
        self.ask(83, b"")

    def ask(self, kind: int, payload: bytes) -> bytes:
        """Send a request and wait for its answer."""
        self.socket.sendall(struct.pack(">HB", 3 + len(payload), kind) + payload)
        while True:
            found, answer = self.package()
            if found == kind:
                return answer

    def package(self) -> tuple[int, bytes]:
        """The next package: type and payload."""
        while True:
            if len(self.buffer) >= 3:
                size, kind = struct.unpack_from(">HB", self.buffer)
                if len(self.buffer) >= size:
                    payload, self.buffer = self.buffer[3:size], self.buffer[size:]
                    return kind, payload
            select.select([self.socket], [], [], 1.0)
            self.buffer += self.socket.recv(4096)

    def receive(self) -> Package:
        """The next data package as an object."""
        while True:
            kind, payload = self.package()
            if kind == 85:
                break
        found, offset = Package(), 1
        for name, word in zip(self.names, self.types, strict=True):
            layout, count = FORMATS[word]
            values = struct.unpack_from(layout, payload, offset)
            offset += struct.calcsize(layout)
            setattr(found, name, values[0] if count == 1 else list(values))
        return found


def read_official(host: str, port: int, *names: str) -> None:
    """In the style of the official client."""
    client = OfficialStyle(host, port, names)
    looked_at = names[:LOOKED_AT]
    while True:
        package = client.receive()
        for name in looked_at:
            getattr(package, name)


def read_ur_rtde(host: str, _port: int, *names: str) -> None:
    """ur_rtde: its thread receives, and the program looks once in each cycle."""
    import rtde_receive

    robot = rtde_receive.RTDEReceiveInterface(host, 500.0, list(names))
    while True:
        started = robot.initPeriod()
        robot.getTimestamp()
        robot.getActualQ()
        robot.getActualQd()
        robot.getActualTCPPose()
        robot.getActualTCPSpeed()
        robot.getActualTCPForce()
        robot.getRobotMode()
        robot.getRuntimeState()
        robot.waitPeriod(started)


# -- a control loop ----------------------------------------------------------------------------------------------------


def loop_gatewayd(host: str, port: int, count: str) -> None:
    """`gatewayd.rtde`, by its asynchronous iterator."""
    written, shown = f"input_int_register_{REGISTER}", f"output_int_register_{REGISTER}"

    async def main() -> None:
        async with rtde.connect(host, port=port, outputs=[shown], inputs={"in": [written]}) as robot:
            sample = await robot.newer(1)
            for number in range(1, int(count) + 1):
                begun, at = sample.timestamp, time.perf_counter()
                await robot.write("in", {written: number})
                async for sample in robot:
                    if sample[shown] == number:
                        break
                _report(sample.timestamp - begun, at)

    asyncio.run(main())


def loop_ur_rtde(host: str, _port: int, count: str) -> None:
    """ur_rtde, which has to be asked again and again."""
    import rtde_io
    import rtde_receive

    names = ["timestamp", f"output_int_register_{REGISTER}"]
    robot, outputs = rtde_receive.RTDEReceiveInterface(host, 500.0, names), rtde_io.RTDEIOInterface(host)
    for number in range(1, int(count) + 1):
        begun, at = robot.getTimestamp(), time.perf_counter()
        outputs.setInputIntRegister(REGISTER, number)
        while robot.getOutputIntRegister(REGISTER) != number:
            time.sleep(0.0001)
        _report(robot.getTimestamp() - begun, at)


def _report(seconds: float, at: float) -> None:
    print(round(seconds / CYCLE), time.perf_counter() - at)


CLIENTS: dict[tuple[str, str], Callable[..., None]] = {
    ("read", "gatewayd"): read_gatewayd,
    ("read", "gatewayd.sync"): read_blocking,
    ("read", "official"): read_official,
    ("read", "ur_rtde"): read_ur_rtde,
    ("loop", "gatewayd"): loop_gatewayd,
    ("loop", "ur_rtde"): loop_ur_rtde,
}

if __name__ == "__main__":
    task, kind, address, number, *rest = sys.argv[1:]
    CLIENTS[task, kind](address, int(number), *rest)
