"""Load on a Modbus server: raw sockets and epoll in this process, one request under way on each connection."""

from __future__ import annotations

import select
import socket
import struct
import time
from dataclasses import dataclass

from tests.benchmarks.report import percentile
from tests.e2e.processes import Process

MBAP = struct.Struct(">HHHB")
EXCEPTION = 0x80
WARM_UP = 0.3
"""Seconds before the measured time."""


@dataclass(frozen=True, slots=True)
class Request:
    """One frame, and how long a good answer to it is."""

    frame: bytes
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


def reading(first: int, count: int, unit: int = 1) -> Request:
    """Read Holding Registers."""
    return Request(MBAP.pack(1, 0, 6, unit) + struct.pack(">BHH", 3, first, count), 9 + 2 * count)


def writing(first: int, count: int, unit: int = 1) -> Request:
    """Write Multiple Registers, all zero."""
    pdu = struct.pack(">BHHB", 16, first, count, 2 * count) + bytes(2 * count)
    return Request(MBAP.pack(1, 0, len(pdu) + 1, unit) + pdu, 12)


def measure(server: Process, port: int, connections: int, request: Request, seconds: float) -> Load:
    """Repeat `request` on so many connections. RuntimeError for an answer that is not the good one."""
    peers = [socket.create_connection(("127.0.0.1", port), 5) for _ in range(connections)]
    try:
        for peer in peers:
            peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        _drive(peers, request, WARM_UP)
        before = server.cpu_seconds()
        round_trips, elapsed = _drive(peers, request, seconds)
        cpu = server.cpu_seconds() - before
    finally:
        for peer in peers:
            peer.close()
    count = len(round_trips)
    return Load(count / elapsed, percentile(round_trips, 0.5), percentile(round_trips, 0.99), cpu / count)


def _drive(peers: list[socket.socket], request: Request, seconds: float) -> tuple[list[float], float]:
    """Every round trip in seconds, and the time that all of them took."""
    clock = time.perf_counter
    sockets = {peer.fileno(): peer for peer in peers}
    sent: dict[int, float] = {}
    round_trips: list[float] = []
    with select.epoll() as poll:
        for number, peer in sockets.items():
            poll.register(number, select.EPOLLIN)
            sent[number] = clock()
            peer.sendall(request.frame)
        begin = clock()
        under_way = len(peers)
        while under_way:
            for number, _ in poll.poll():
                answer = sockets[number].recv(512)
                now = clock()
                if len(answer) != request.answer or answer[7] & EXCEPTION:
                    raise RuntimeError(f"unexpected answer of {len(answer)} bytes: {answer[:9].hex(' ')}")
                round_trips.append(now - sent[number])
                if now - begin < seconds:
                    sent[number] = now
                    sockets[number].send(request.frame)
                else:
                    under_way -= 1
        return round_trips, clock() - begin
