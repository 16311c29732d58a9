"""A small CANopen master: it knows nothing of gatewayd but its node-ID, its COB-IDs and what they carry.

The master is that of a line around the robot cell. It starts the node by NMT, sends SYNC and its own heartbeat, sets
the feed of the line by RPDO, and compares what the TPDOs report with what it has asked for. `Feeder` is the logic
alone; `Master` is the traffic on a bus of python-can.
"""

from __future__ import annotations

import asyncio
import math
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import can

from gatewayd.loop import clock

NODE = 16
"""Node-ID of the gateway."""
EMERGENCY = 0x080 + NODE
MEASURED = 0x180 + NODE
"""TPDO 1, with each SYNC: force and feed."""
SIGNALS = 0x280 + NODE
"""TPDO 2, when it changes: busy and done."""
INTEGERS = 0x380 + NODE
"""TPDO 3, when it changes: part_done and cycles."""
SET_FEED = 0x200 + NODE
"""RPDO 1: the feed."""
HEARTBEAT = 0x700 + NODE
OPERATIONAL = 5
SILENCE = 1.5
"""Seconds without its heartbeat after which the node counts as lost: three periods."""
FEEDS = (60.0, 80.0, 70.0, 90.0)
"""What the line asks for, one after the other, in percent."""
CHECKS = 1
"""Values that have to come back before the CANopen side has shown what it is for."""

_OWN_HEARTBEAT = 0x701
_NMT, _SYNC = 0x000, 0x080
_START_NODE = bytes([1, NODE])
_BOOT_UP, _PRE_OPERATIONAL = 0, 127
_HELD = 0xFF01
"""EMCY: an RPDO was dropped because somebody else owns what it writes."""
_MEASURED = struct.Struct("<ff")
_INTEGERS = struct.Struct("<ii")
_FEED = struct.Struct("<f")
_LOOK = 0.01
"""Seconds between two looks at the bus, which has nothing that could be waited for."""
_SYNC_PERIOD, _BEAT_PERIOD, _FEED_PERIOD = 0.1, 0.25, 0.2
RETRY = 0.7
"""Seconds between two RPDOs while they are refused; shorter than the lease, which the first one taken begins."""
_STAY = 4.0
"""Seconds for which one feed is asked for."""
_PATIENCE = 15
"""Requests, 3 s of them, by which what was asked for must have come back; a process that was stopped sends none."""
_WRONG_KEPT = 3


@dataclass
class Feeder:
    """What the line wants, and whether it gets it. Times are monotonic seconds."""

    wanted: float = FEEDS[0]
    verified: int = 0
    """Feeds that came back, and parts that were counted without a gap."""
    wrong: list[str] = field(default_factory=list)
    """What was not as it should be, in words; the first few."""
    refusals: int = 0
    """Times that the node has begun to refuse the feed."""
    held: bool = False
    """The node refuses the feed now."""
    _since: float = math.inf
    _asked: int = 0
    _came_back: bool = False
    _cycles: int | None = None

    def restart(self) -> None:
        """The node has booted: nothing of before counts."""
        self.held, self._cycles = False, None
        self._begin(math.inf)

    def ask(self, now: float) -> float:
        """The feed to send now; a new one when the last one came back and had its time."""
        if self._since == math.inf:
            self._since = now
        if self._came_back and now - self._since >= _STAY:
            self.wanted = FEEDS[(FEEDS.index(self.wanted) + 1) % len(FEEDS)]
            self._begin(now)
        elif not self._came_back and not self.held:
            self._asked += 1
            if self._asked > _PATIENCE:
                self._complain(f"the feed never became {self.wanted:g} %")
                self._begin(now)
        return self.wanted

    def emergency(self, code: int, now: float) -> None:
        """The node reports an error, or with 0 that there is none any more."""
        if code == _HELD:
            self.held, self._came_back = True, False
            self.refusals += 1
        elif code == 0 and self.held:
            self.held = False
            self._begin(now)

    def measured(self, feed: float) -> None:
        """The feed that the robot has."""
        if feed == self.wanted and not self.held and not self._came_back:
            self._came_back = True
            self.verified += 1

    def counted(self, cycles: int) -> None:
        """The robot's counter of parts."""
        before, self._cycles = self._cycles, cycles
        if before is None or cycles == before:
            return
        if cycles == before + 1:
            self.verified += 1
        else:
            self._complain(f"cycles went from {before} to {cycles}")

    def _begin(self, now: float) -> None:
        self._since, self._asked, self._came_back = now, 0, False

    def _complain(self, what: str) -> None:
        if len(self.wrong) < _WRONG_KEPT:
            self.wrong.append(what)


class Master:
    """The master on a channel of python-can's virtual bus, which lies within this process."""

    def __init__(self, channel: str) -> None:
        self.feeder = Feeder()
        self.state: int | None = None
        """The node's NMT state by its heartbeat; None before the first one."""
        self.heartbeats = 0
        self.received = 0
        """PDOs from the node."""
        self.sent = 0
        """PDOs to the node."""
        self.emergencies = 0
        self.gone = False
        """The node's heartbeat stayed away once it had been heard."""
        self._channel = channel
        self._bus: can.BusABC | None = None
        self._heard = -math.inf
        self._latest: deque[float] = deque()
        self._jobs: list[tuple[Callable[[float], float], float]] = []
        self._handlers: dict[int, Callable[[bytes, float], None]] = {
            HEARTBEAT: self._on_heartbeat,
            EMERGENCY: self._on_emergency,
            MEASURED: self._on_measured,
            SIGNALS: self._on_pdo,
            INTEGERS: self._on_integers,
        }

    def lives(self, now: float) -> bool:
        """Whether the node's heartbeat was heard lately."""
        return now - self._heard <= SILENCE

    def operational(self, now: float) -> bool:
        """Whether PDOs flow."""
        return self.lives(now) and self.state == OPERATIONAL

    def rate(self, now: float) -> int:
        """PDOs from the node within the last second."""
        while self._latest and now - self._latest[0] > 1:
            self._latest.popleft()
        return len(self._latest)

    async def run(self) -> None:
        """Drive the node until cancelled."""
        self._bus = can.Bus(interface="virtual", channel=self._channel)
        now = clock.now()
        self._jobs = [(self._sync, now), (self._beat, now), (self._feed, now)]
        try:
            while True:
                self._receive(self._bus)
                now = clock.now()
                self._jobs = [(job, job(now) if now >= due else due) for job, due in self._jobs]
                await asyncio.sleep(_LOOK)
        finally:
            self._bus.shutdown()

    def _receive(self, bus: can.BusABC) -> None:
        while (message := bus.recv(0)) is not None:
            handler = self._handlers.get(message.arbitration_id)
            if handler is not None:
                handler(bytes(message.data), clock.now())

    def _send(self, can_id: int, data: bytes = b"") -> None:
        assert self._bus is not None
        self._bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    # What is sent; each returns when it is due again.

    def _sync(self, now: float) -> float:
        self._send(_SYNC)
        return now + _SYNC_PERIOD

    def _beat(self, now: float) -> float:
        self.gone = self.heartbeats > 0 and not self.lives(now)
        self._send(_OWN_HEARTBEAT, bytes([OPERATIONAL]))
        return now + _BEAT_PERIOD

    def _feed(self, now: float) -> float:
        if not self.operational(now):
            return now + _FEED_PERIOD
        self._send(SET_FEED, _FEED.pack(self.feeder.ask(now)))
        self.sent += 1
        return now + (RETRY if self.feeder.held else _FEED_PERIOD)

    # What is received.

    def _on_heartbeat(self, data: bytes, now: float) -> None:
        self.heartbeats += 1
        self._heard, self.state = now, data[0] & 0x7F
        if self.state == _BOOT_UP:
            self.feeder.restart()
        if self.state in (_BOOT_UP, _PRE_OPERATIONAL):
            self._send(_NMT, _START_NODE)

    def _on_emergency(self, data: bytes, now: float) -> None:
        code = int.from_bytes(data[:2], "little")
        self.emergencies += code != 0
        self.feeder.emergency(code, now)

    def _on_pdo(self, data: bytes, now: float) -> None:
        self.received += 1
        self._latest.append(now)

    def _on_measured(self, data: bytes, now: float) -> None:
        self._on_pdo(data, now)
        self.feeder.measured(_MEASURED.unpack(data)[1])

    def _on_integers(self, data: bytes, now: float) -> None:
        self._on_pdo(data, now)
        self.feeder.counted(_INTEGERS.unpack(data)[1])
