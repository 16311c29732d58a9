"""Load on a Modbus server: raw sockets and epoll in this process, one request under way on each connection."""

from __future__ import annotations

import select
import socket
import struct
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import cycle

from tests.benchmarks.report import percentile
from tests.benchmarks.usage import usage

MBAP = struct.Struct(">HHHB")
EXCEPTION = 0x80
WARM_UP = 0.15
"""Seconds before the measured time."""
VARIETY = 97
"""Frames of a request whose values change: no divisor of the number of connections, so that each finds other values."""


@dataclass(frozen=True, slots=True)
class Request:
    """Frames that are sent in turn, and how long a good answer to each of them is."""

    frames: Sequence[bytes]
    answer: int


@dataclass(frozen=True, slots=True)
class Load:
    """What one run measured."""

    per_second: float
    """Requests answered."""
    p50: float
    """Median round trip in seconds."""
    p99: float
    cpu: float
    """Seconds of the server's CPU time for each request."""


def frame(pdu: bytes, unit: int = 1) -> bytes:
    """A PDU as it goes over TCP."""
    return MBAP.pack(1, 0, len(pdu) + 1, unit) + pdu


def reading(first: int, count: int, unit: int = 1) -> Request:
    """Read Holding Registers (FC03)."""
    return Request([frame(struct.pack(">BHH", 3, first, count), unit)], 9 + 2 * count)


def writing(first: int, contents: Sequence[bytes]) -> Request:
    """Write Multiple Registers (FC16): each content in turn, all of one length."""
    size = len(contents[0])
    head = struct.pack(">BHHB", 16, first, size // 2, size)
    return Request([frame(head + content) for content in contents], 12)


def writing_and_reading(first: int, contents: Sequence[bytes], read: int, count: int) -> Request:
    """Read/Write Multiple Registers (FC23)."""
    size = len(contents[0])
    head = struct.pack(">BHHHHB", 23, read, count, first, size // 2, size)
    return Request([frame(head + content) for content in contents], 9 + 2 * count)


def writing_coils(first: int, contents: Sequence[bytes]) -> Request:
    """Write Multiple Coils (FC15), whole bytes."""
    size = len(contents[0])
    head = struct.pack(">BHHB", 15, first, 8 * size, size)
    return Request([frame(head + content) for content in contents], 12)


def measure(pid: int, port: int, connections: int, request: Request, seconds: float) -> Load:
    """Repeat `request` on so many connections to a server. RuntimeError for an answer that is not the good one."""
    peers = [socket.create_connection(("127.0.0.1", port), 5) for _ in range(connections)]
    try:
        for peer in peers:
            peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        frames = cycle(request.frames)
        _drive(peers, frames, request.answer, WARM_UP)
        before = usage(pid).cpu
        round_trips, elapsed = _drive(peers, frames, request.answer, seconds)
        cpu = usage(pid).cpu - before
    finally:
        for peer in peers:
            peer.close()
    count = len(round_trips)
    return Load(count / elapsed, percentile(round_trips, 0.5), percentile(round_trips, 0.99), cpu / count)


def _drive(
    peers: list[socket.socket], frames: Iterator[bytes], size: int, seconds: float
) -> tuple[list[float], float]:
    """Every round trip in seconds, and the time that all of them took."""
    clock = time.perf_counter
    sockets = {peer.fileno(): peer for peer in peers}
    sent: dict[int, float] = {}
    round_trips: list[float] = []
    with select.epoll() as poll:
        for number, peer in sockets.items():
            poll.register(number, select.EPOLLIN)
            sent[number] = clock()
            peer.sendall(next(frames))
        begin = clock()
        under_way = len(peers)
        while under_way:
            for number, _ in poll.poll():
                answer = sockets[number].recv(512)
                now = clock()
                if len(answer) != size or answer[7] & EXCEPTION:
                    raise RuntimeError(f"unexpected answer of {len(answer)} bytes: {answer[:9].hex(' ')}")
                round_trips.append(now - sent[number])
                if now - begin < seconds:
                    sent[number] = now
                    sockets[number].send(next(frames))
                else:
                    under_way -= 1
        return round_trips, clock() - begin
