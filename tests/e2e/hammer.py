"""A Modbus client that hammers: pipelined requests on a raw socket, every answer checked.

python -m tests.e2e.hammer HOST PORT SOURCE read ADDRESS COUNT
    Read blocks of 24 doubles that hold one value each time; print how many different ones were seen.
python -m tests.e2e.hammer HOST PORT SOURCE write ADDRESS
    Write 12 integers and 24 doubles that hold one number each time, until standard input ends; print the last one.
"""

from __future__ import annotations

import select
import socket
import struct
import sys
import time
from typing import NoReturn

INTEGERS, DOUBLES = 12, 24
_DEPTH = 16
"""Requests under way."""
_HEAD = struct.Struct(">HHHBB")
_READ = struct.Struct(">HHHBBHH")
_WRITE = struct.Struct(f">HHHBBHHB{INTEGERS}i{DOUBLES}d")
_WRITTEN = struct.Struct(">HHHBBHH")
_WORDS = 2 * INTEGERS + 4 * DOUBLES


def fail(text: str) -> NoReturn:
    print(f"torn: {text}", flush=True)
    sys.exit(1)


def receive(connection: socket.socket, size: int) -> bytes:
    data = bytearray()
    while len(data) < size:
        part = connection.recv(size - len(data))
        if not part:
            fail("the gateway has closed the connection")
        data += part
    return bytes(data)


def read(connection: socket.socket, address: int, count: int) -> None:
    words = 4 * DOUBLES
    size = 9 + 2 * words
    seen: set[bytes] = set()
    start = time.monotonic()
    sent = 0
    for done in range(0, count, _DEPTH):
        batch = min(_DEPTH, count - done)
        connection.sendall(
            b"".join(_READ.pack(n & 0xFFFF, 0, 6, 1, 3, address, words) for n in range(sent, sent + batch))
        )
        data = receive(connection, batch * size)
        for position in range(0, batch * size, size):
            transaction, _, _, _, function = _HEAD.unpack_from(data, position)
            if function != 3 or transaction != sent & 0xFFFF:
                fail(f"answer {data[position : position + 12].hex()} to request {sent}")
            sent += 1
            one = data[position + 9 : position + 17]
            if data[position + 9 : position + size] != one * DOUBLES:
                fail(f"read {struct.unpack(f'>{DOUBLES}d', data[position + 9 : position + size])}")
            seen.add(one)
    took = time.monotonic() - start
    print(f"{sent} reads {len(seen)} values {sent / took:.0f} per second", flush=True)


def write(connection: socket.socket, address: int) -> None:
    number = 0
    while not select.select([sys.stdin], [], [], 0)[0]:
        requests = []
        for _ in range(_DEPTH):
            number += 1
            values = (*[number] * INTEGERS, *[float(number)] * DOUBLES)
            requests.append(
                _WRITE.pack(number & 0xFFFF, 0, 7 + 2 * _WORDS, 1, 16, address, _WORDS, 2 * _WORDS, *values)
            )
        connection.sendall(b"".join(requests))
        data = receive(connection, _DEPTH * _WRITTEN.size)
        for _, _, _, _, function, _, words in _WRITTEN.iter_unpack(data):
            if function != 16 or words != _WORDS:
                fail(f"answers {data.hex()} to writes")
    print(f"last {number}", flush=True)


def main() -> None:
    host, port, source, what, address, *count = sys.argv[1:]
    connection = socket.create_connection((host, int(port)), 30, (source, 0))
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    if what == "read":
        read(connection, int(address), int(count[0]))
    else:
        write(connection, int(address))


if __name__ == "__main__":
    main()
