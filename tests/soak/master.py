"""The CANopen master of the soak run, as a process: starts the node, writes and reads without end, and comes back.

    python -m tests.soak.master CHANNEL NODE PAUSE FIELD FIELD JOURNAL

Each PAUSE seconds it sends its heartbeat. While the node's own heartbeat says OPERATIONAL it sends an RPDO as well: a
counter, and what the node's TPDO last said of that counter. So the second number moves only if both ways are open.
What it sent, by the FIELD of the robot, stands in the file JOURNAL.
"""

from __future__ import annotations

import struct
import sys
import time
from collections.abc import Sequence
from contextlib import suppress

import can

from tests.soak.journal import Journal

NMT, TPDO, RPDO, HEARTBEAT = 0x000, 0x180, 0x200, 0x700
"""COB-IDs of the predefined connection set, less the node-ID."""
OPERATIONAL = 5
_START = 1
_MASTER = 1
"""Its node-ID."""
_PAIR = struct.Struct("<ii")
_LOST = 1.0
"""Seconds without a heartbeat of the node after which the bus is opened anew: an adapter need not report its end."""
_RETRY = 0.1
_MAX = 30_000


class _Node:
    """The node as this master sees it."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.state: int | None = None
        self.answered = 0
        self._heard = time.monotonic()

    def hear(self, message: can.Message) -> None:
        """Take what it says of itself; all else on the bus is not for the master."""
        data = bytes(message.data)
        if message.arbitration_id == HEARTBEAT + self.number and len(data) == 1:
            self.state, self._heard = data[0], time.monotonic()
        elif message.arbitration_id == TPDO + self.number and len(data) == _PAIR.size:
            self.answered = _PAIR.unpack(data)[0]

    def supervise(self) -> None:
        """Raises ConnectionError if its heartbeat is missing."""
        if time.monotonic() - self._heard > _LOST:
            raise ConnectionError("no heartbeat of the node")


def _send(bus: can.BusABC, identifier: int, data: bytes) -> None:
    bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))


def _cycle(bus: can.BusABC, node: _Node, counter: int, fields: Sequence[str], journal: Journal) -> None:
    _send(bus, HEARTBEAT + _MASTER, bytes([OPERATIONAL]))
    if node.state == OPERATIONAL:
        for field, value in zip(fields, (counter, node.answered), strict=True):
            journal.note(field, value)
        _send(bus, RPDO + node.number, _PAIR.pack(counter, node.answered))
    elif node.state is not None:
        _send(bus, NMT, bytes([_START, node.number]))


def _serve(bus: can.BusABC, number: int, pause: float, fields: Sequence[str], journal: Journal) -> None:
    node = _Node(number)
    counter, due = 0, time.monotonic()
    while True:
        message = bus.recv(max(0.0, due - time.monotonic()))
        if message is not None:
            node.hear(message)
        node.supervise()
        if time.monotonic() >= due:
            due = time.monotonic() + pause
            counter = counter % _MAX + 1
            _cycle(bus, node, counter, fields, journal)


def _main(channel: str, number: str, pause: str, *others: str) -> None:
    fields, journal = others[:2], Journal(others[2])
    while True:
        # ValueError, IndexError: nonsense on the line, as a broken adapter says it.
        with (
            suppress(OSError, ValueError, IndexError, can.CanError),
            can.Bus(channel, interface="slcan", bitrate=1_000_000, sleep_after_open=0) as bus,
        ):
            _serve(bus, int(number), float(pause), fields, journal)
        time.sleep(_RETRY)


if __name__ == "__main__":
    _main(*sys.argv[1:])
