"""The other end of a node's bus, as a process of the benchmark: what it sends, what comes back, what that costs."""

from __future__ import annotations

import errno
import select
import socket
import struct
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from gatewayd.canopen.socketcan import RECEIVE_BUFFER
from tests.benchmarks.can_node import COB_IDS, NODE
from tests.benchmarks.trees import Tree
from tests.e2e.processes import Process

SLOT = 0.01
BATCH = 40
"""Frames sent between two readings: fewer than a socket holds."""
BATCHES = 25
RECEIVE_BATCH = 10_000
SYNCS_PER_SECOND = 200
PATIENCE = 5.0
_FRAME = struct.Struct("=IB3x8s")
_NMT, _SYNC, _TPDO = 0x000, 0x080, 0x380 + NODE
_ENTER_PRE_OPERATIONAL = 128


class Peer:
    """The other end of a node's bus."""

    def __init__(self, tree: Tree, kind: str, folder: str) -> None:
        self.socket, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, RECEIVE_BUFFER)
        with other:
            command = tree.command(Path(__file__).with_name("can_node.py"), str(other.fileno()), kind)
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
def node(tree: Tree, kind: str) -> Iterator[Peer]:
    """A node of this kind as a process, on the code of this tree."""
    with tempfile.TemporaryDirectory() as folder:
        peer = Peer(tree, kind, folder)
        try:
            yield peer
        finally:
            peer.process.kill()
            peer.socket.close()


@dataclass(frozen=True)
class Reception:
    rate: float
    """Frames per second."""
    lost: int
    cpu: float
    """Seconds per frame."""


def receive(peer: Peer, kind: int, rate: float, seconds: float) -> Reception:
    """Send RPDOs with new values at this rate."""
    peer.received(0.2)
    count_before, cpu_before = peer.ask("report")
    can_id, sent, refused, offered = COB_IDS[kind], 0, 0, 0.0
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
    return Reception(
        (sent + refused) / elapsed, refused + sent - received, (cpu - cpu_before) / max(1, received)
    )


def in_process(peer: Peer, kind: int) -> float:
    """CPU seconds per frame, from the node into the cell."""
    (cpu,) = peer.ask(f"receive {kind} {RECEIVE_BATCH}")
    return cpu / RECEIVE_BATCH


def transmit(peer: Peer, kind: int) -> float:
    """CPU seconds per frame."""
    costs = []
    for _ in range(BATCHES):
        peer.received()
        (cpu,) = peer.ask(f"transmit {kind} {BATCH}")
        frames = peer.received(0.01)
        if len(frames) < BATCH:
            raise RuntimeError(f"{len(frames)} of {BATCH} frames came")
        costs.append(cpu / BATCH)
    return median(costs)


def syncs(peer: Peer, seconds: float) -> list[float]:
    """Seconds from each SYNC to its TPDO."""
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


def make_synchronous(peer: Peer) -> None:
    """Give the third TPDO of gatewayd's node transmission type 1."""
    peer.send(0x600 + NODE, bytes.fromhex("2f02180201000000"))
    if not peer.answered(0x580 + NODE):
        raise RuntimeError("no answer to the write of 1802h")


def leave_operational(peer: Peer) -> None:
    """Have the node drop PDOs."""
    peer.send(_NMT, bytes([_ENTER_PRE_OPERATIONAL, NODE]))
