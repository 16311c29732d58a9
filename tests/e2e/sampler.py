"""A second RTDE client, in 60 lines of its own: samples the robot's inputs in every control cycle.

python -m tests.e2e.sampler HOST PORT
    Until standard input ends: 12 integers and 24 doubles must hold one number in every package, and never an older
    one than before. Then print how many packages there were.
"""

from __future__ import annotations

import select
import socket
import struct
import sys
from typing import NoReturn

from tests.e2e.hammer import DOUBLES, INTEGERS

NAMES = [
    *(f"input_int_register_{number}" for number in range(INTEGERS)),
    *(f"input_double_register_{number}" for number in range(DOUBLES)),
]
_HEAD = struct.Struct(">HB")
_PACKAGE = struct.Struct(f">B{INTEGERS}i{DOUBLES}d")


def fail(text: str) -> NoReturn:
    print(f"torn: {text}", flush=True)
    sys.exit(1)


class Robot:
    """The connection: messages in, messages out."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), 30)
        self._file = self._socket.makefile("rb")

    def ask(self, kind: bytes, payload: bytes = b"") -> bytes:
        """Send a request; the payload of its answer."""
        self._socket.sendall(_HEAD.pack(_HEAD.size + len(payload), kind[0]) + payload)
        answer, found = self.message()
        if answer != kind[0]:
            fail(f"answer {answer:#x} to {kind!r}")
        return found

    def message(self) -> tuple[int, bytes]:
        """The next message."""
        size, kind = _HEAD.unpack(self._file.read(_HEAD.size))
        return kind, self._file.read(size - _HEAD.size)


def main() -> None:
    robot = Robot(sys.argv[1], int(sys.argv[2]))
    robot.ask(b"V", struct.pack(">H", 2))
    types = robot.ask(b"O", struct.pack(">d", 500) + ",".join(NAMES).encode())[1:].decode()
    if types.split(",") != ["INT32"] * INTEGERS + ["DOUBLE"] * DOUBLES:
        fail(types)
    robot.ask(b"S")
    print("sampling", flush=True)
    packages, values, last = 0, 0, -1
    while not select.select([sys.stdin], [], [], 0)[0]:
        kind, payload = robot.message()
        if kind != ord("U"):
            fail(f"message {kind:#x}")
        _, first, *others = _PACKAGE.unpack(payload)
        if others.count(first) != len(others):
            fail(f"one package holds {first} and {others}")
        if first < last:
            fail(f"{first} after {last}")
        packages += 1
        values += first != last
        last = first
    print(f"{packages} packages {values} values last {last}", flush=True)


if __name__ == "__main__":
    main()
