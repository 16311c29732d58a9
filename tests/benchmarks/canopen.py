"""What a PDO costs, beside python-canopen's own way; how soon a SYNC is answered; a saturated bus."""

from __future__ import annotations

import errno
import select
import socket
import struct
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from gatewayd.canopen.socketcan import RECEIVE_BUFFER
from tests.benchmarks.can_node import BITS, INTEGERS, NODE
from tests.benchmarks.report import Table, at_least, at_most, histogram, percentile
from tests.e2e.processes import Process

SATURATED = 8752
"""Frames of 8 bytes that a bus of 1 Mbit/s carries in a second, with stuffing as it falls."""
SLOT = 0.01
BATCH = 40
"""Frames sent between two readings: fewer than a socket holds."""
ROUNDS = 25
SYNCS_PER_SECOND = 200
PATIENCE = 5.0
TO_NODE = "received, up to the node"
BOUNDS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0)
CPU_AIM = 5.0
"""us of CPU per received frame."""
_FRAME = struct.Struct("=IB3x8s")
_NMT, _SYNC, _TPDO = 0x000, 0x080, 0x380 + NODE
_RPDOS = {BITS: 0x200 + NODE, INTEGERS: 0x300 + NODE}
_START, _ENTER_PRE_OPERATIONAL = 1, 128

COST = """\
Both nodes are processes at the end of a pair of sockets that carries SocketCAN's frames, so both run the code that they
run on SocketCAN. Received: RPDOs with new values, up to the values in the cell (gatewayd: checked for owner and limits,
and told to the listeners) or in Python variables (canopen: its notifier, a callback, `.raw`); integers at the rate of
a saturated bus of 1 Mbit/s, bits at a tenth of it. Up to the node: the same in PRE-OPERATIONAL, where gatewayd drops
RPDOs as CiA 301 demands, so that only driver and dispatch are left; a LocalNode knows no such state. Sent: values of
the robot up to the frame in the socket (canopen: `.raw`, `transmit`). User and system time of the process per
frame; ratio: canopen / gatewayd."""
SATURATION = """\
The same frames: as many in each slot of 10 ms as the bus carries. Lost: no room in the socket, or never counted."""
LATENCY = """\
SYNC handed to the kernel by another process -> a TPDO of type 1 in its hands, socket pair both ways included."""


class Peer:
    """The other end of a node's bus."""

    def __init__(self, kind: str, folder: str) -> None:
        self.socket, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, RECEIVE_BUFFER)
        with other:
            command = [sys.executable, "-m", "tests.benchmarks.can_node", str(other.fileno()), kind]
            self.process = Process(command, Path(folder) / kind, pass_fds=(other.fileno(),))
        said = self.process.answer()
        if said != "ready":
            raise RuntimeError(said + self.process.text())

    def ask(self, order: str) -> list[float]:
        """An order's answer."""
        assert self.process.popen.stdin is not None
        self.process.popen.stdin.write(order + "\n")
        return [float(word) for word in self.process.answer().split()]

    def send(self, can_id: int, data: bytes) -> bool:
        """Whether there was room."""
        try:
            self.socket.send(_FRAME.pack(can_id, len(data), data), socket.MSG_DONTWAIT)
        except OSError as error:
            if error.errno not in (errno.EAGAIN, errno.ENOBUFS):
                raise
            return False
        return True

    def received(self, seconds: float = 0.0) -> list[int]:
        """Identifiers of what has come."""
        found = []
        while select.select([self.socket], [], [], seconds)[0]:
            found.append(_FRAME.unpack(self.socket.recv(16))[0])
            seconds = 0.0
        return found

    def answered(self, can_id: int) -> bool:
        """Wait for a frame of this identifier."""
        end = time.perf_counter() + PATIENCE
        while time.perf_counter() < end:
            if can_id in self.received(PATIENCE):
                return True
        return False


@contextmanager
def _node(kind: str) -> Iterator[Peer]:
    with tempfile.TemporaryDirectory() as folder:
        peer = Peer(kind, folder)
        try:
            yield peer
        finally:
            peer.process.kill()
            peer.socket.close()


def run(seconds: float) -> list[Table]:
    """Three tables."""
    cost = Table("CPU per PDO frame", COST, ("frame", "gatewayd", "canopen", "ratio"))
    saturation = Table(
        "A saturated bus of 1 Mbit/s", SATURATION, ("node", "frames/s", "lost", "share of a core")
    )
    latency = Table("SYNC -> TPDO", LATENCY, ("time", "gatewayd", "canopen", ""))
    costs: dict[str, dict[str, float]] = {}
    times: dict[str, list[float]] = {}
    for kind in ("gatewayd", "canopen"):
        with _node(kind) as peer:
            found = _receive(peer, INTEGERS, SATURATED, seconds)
            lost = at_most(found.lost, 0) if kind == "gatewayd" else str(found.lost)
            saturation.add(kind, f"{found.rate:.0f}", lost, f"{100 * found.cpu * found.rate:.1f} %")
            costs[kind] = {
                "received, 2 integers": found.cpu,
                "received, 64 bits": _receive(peer, BITS, SATURATED / 10, seconds).cpu,
                "sent, 2 integers": _transmit(peer, INTEGERS),
                "sent, 64 bits": _transmit(peer, BITS),
            }
            times[kind] = _syncs(peer, kind, seconds)
            peer.send(_NMT, bytes([_ENTER_PRE_OPERATIONAL, NODE]))
            costs[kind][TO_NODE] = _receive(peer, INTEGERS, SATURATED, seconds).cpu
    for name, ours in costs["gatewayd"].items():
        theirs = costs["canopen"][name]
        if name == TO_NODE:
            cost.add(name, at_most(ours * 1e6, CPU_AIM, " us"), "-", "-")
        else:
            cost.add(name, f"{ours * 1e6:.1f} us", f"{theirs * 1e6:.1f} us", at_least(theirs / ours, 1.0))
    for name, share in (("p50", 0.5), ("p99", 0.99)):
        latency.add(name, *(f"{percentile(times[kind], share) * 1000:.3f} ms" for kind in times))
    latency.rows += [(bound, part, "", bar) for bound, part, bar in histogram(times["gatewayd"], BOUNDS)]
    return [cost, saturation, latency]


@dataclass(frozen=True)
class _Reception:
    rate: float
    """Frames per second."""
    lost: int
    cpu: float
    """Seconds per frame."""


def _receive(peer: Peer, kind: int, rate: float, seconds: float) -> _Reception:
    """Send RPDOs with new values at this rate."""
    peer.received(0.2)
    count_before, cpu_before = peer.ask("report")
    can_id, sent, refused, offered = _RPDOS[kind], 0, 0, 0.0
    begin = slot = time.perf_counter()
    while slot - begin < seconds:
        offered += rate * SLOT
        while sent + refused < int(offered):
            if peer.send(can_id, struct.pack("<ii", sent, -sent)):
                sent += 1
            else:
                refused += 1
        # Slots that were missed are not made up for: no bus is faster than it is.
        slot = max(slot + SLOT, time.perf_counter())
        time.sleep(max(0.0, slot - time.perf_counter()))
    elapsed = time.perf_counter() - begin
    end = time.perf_counter() + PATIENCE
    while True:
        count, cpu = peer.ask("report")
        if count - count_before >= sent or time.perf_counter() > end:
            break
        time.sleep(0.05)
    received = int(count - count_before)
    return _Reception(
        (sent + refused) / elapsed, refused + sent - received, (cpu - cpu_before) / max(1, received)
    )


def _transmit(peer: Peer, kind: int) -> float:
    """CPU seconds per frame."""
    costs = []
    for _ in range(ROUNDS):
        peer.received()
        (cpu,) = peer.ask(f"transmit {kind} {BATCH}")
        frames = peer.received(0.01)
        if len(frames) < BATCH:
            raise RuntimeError(f"{len(frames)} of {BATCH} frames came")
        costs.append(cpu / BATCH)
    return median(costs)


def _syncs(peer: Peer, kind: str, seconds: float) -> list[float]:
    """Seconds from each SYNC to its TPDO."""
    if kind == "gatewayd":
        peer.send(0x600 + NODE, bytes.fromhex("2f02180201000000"))
        if not peer.answered(0x580 + NODE):
            raise RuntimeError("no answer to the write of 1802h")
    times = []
    for _ in range(round(seconds * SYNCS_PER_SECOND)):
        time.sleep(1 / SYNCS_PER_SECOND)
        peer.received()
        begin = time.perf_counter()
        peer.send(_SYNC, b"")
        if not peer.answered(_TPDO):
            raise TimeoutError(f"no TPDO on a SYNC within {PATIENCE:g} s")
        times.append(time.perf_counter() - begin)
    return times
