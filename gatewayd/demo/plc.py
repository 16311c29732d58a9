"""A small PLC program, and the scan that runs it: a Modbus TCP client that knows nothing of gatewayd but addresses.

The program orders parts by a handshake of four phases: order and `start`, `busy`, `done` and a check of the answers,
`start` taken back. `Program` is the logic alone, one call a scan; `Plc` is the scan over a real connection.
"""

from __future__ import annotations

import asyncio
import logging
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from pymodbus.client import AsyncModbusTcpClient
from pymodbus.exceptions import ModbusException

SCAN = 0.05
"""Seconds from one scan to the next."""
FORCE_SHARE = 0.9
"""What the robot program makes of the force limit: it presses with 90 % of it."""
SLOW_FEED = 20
"""Percent: the feed that the PLC sets for every tenth part, whatever the line has asked for."""
CHECKS_PER_HANDSHAKE = 3
"""Values compared at the end of each handshake: part number, force, cycle counter."""

_STATUS = 60000
_FRESH_AND_WRITABLE = 0b11
_ANSWERS = 100
_ORDER = 0
_FEED = 12
_LAYOUT = struct.Struct(">Hiif")
"""Registers 100 to 106: bits, part_done, cycles, force."""
_TIMEOUT = 1.0
_PAUSE = 0.2
"""Seconds before the next attempt to connect."""
_FIRST_PART, _PARTS = 101, 800
_SLOW_EVERY, _SLOW_FIRST = 10, 2
_MIN_FORCE, _FORCE_STEP, _FORCES = 40.0, 7.5, 12

# A gateway that does not answer is part of the show; what the client has to say of it would count as its defect.
logging.getLogger("pymodbus").setLevel(logging.CRITICAL)


class Phase(Enum):
    """Where the handshake is; the value is what the screen shows."""

    WAITING = "waits for the robot"
    ORDERED = "has ordered"
    WORKING = "sees the robot at work"
    CLEARING = "takes start back"


class Signal(Enum):
    """What a scan means for the handshake."""

    LOST = "robot values are not fresh, or the robot cannot be written"
    READY = "neither busy nor done"
    BUSY = "busy"
    DONE = "done"


TRANSITIONS: dict[tuple[Phase, Signal], Phase] = {
    (Phase.WAITING, Signal.READY): Phase.ORDERED,
    (Phase.ORDERED, Signal.BUSY): Phase.WORKING,
    (Phase.WORKING, Signal.DONE): Phase.CLEARING,
    (Phase.CLEARING, Signal.READY): Phase.WAITING,
    **{(phase, Signal.LOST): Phase.WAITING for phase in Phase},
}
"""A pair that is not listed leaves the phase as it is."""


@dataclass(frozen=True, slots=True)
class Answers:
    """What the PLC reads in one scan, in the robot's units."""

    alive: bool
    """The status block says: values fresh, robot writable."""
    busy: bool = False
    done: bool = False
    part_done: int = 0
    cycles: int = 0
    force: float = 0.0

    @property
    def signal(self) -> Signal:
        """What it means for the handshake."""
        if not self.alive:
            return Signal.LOST
        if self.done:
            return Signal.DONE
        return Signal.BUSY if self.busy else Signal.READY


@dataclass(frozen=True, slots=True)
class Order:
    """What the PLC writes in one request."""

    start: bool = False
    part_number: int = 0
    force_limit: float = 0.0
    slow: bool = False
    """The part needs a slow feed: the PLC sets it as long as `start` is given."""

    @property
    def words(self) -> list[int]:
        """Registers 0 to 2: start, part number, force in 0.1 N."""
        return [int(self.start), self.part_number, round(self.force_limit * 10)]


@dataclass
class Program:
    """The logic: answers in, order out, results counted."""

    phase: Phase = Phase.WAITING
    order: Order = field(default_factory=Order)
    handshakes: int = 0
    verified: int = 0
    """Values that came back as they should."""
    wrong: list[str] = field(default_factory=list)
    """What did not, in words; the first few."""
    _cycles_before: int = 0

    def scan(self, answers: Answers) -> Order:
        """One scan of the program."""
        before, self.phase = self.phase, TRANSITIONS.get((self.phase, answers.signal), self.phase)
        if before is self.phase:
            return self.order
        if self.phase is Phase.ORDERED:
            self._cycles_before = answers.cycles
            self.order = self._next_order()
        elif self.phase is not Phase.WORKING:
            if self.phase is Phase.CLEARING:
                self._verify(answers)
            elif answers.alive:
                self.handshakes += 1
            self.order = Order(False, self.order.part_number, self.order.force_limit)
        return self.order

    def _next_order(self) -> Order:
        number = self.handshakes
        return Order(
            True,
            _FIRST_PART + number % _PARTS,
            _MIN_FORCE + _FORCE_STEP * (number % _FORCES),
            slow=number % _SLOW_EVERY == _SLOW_FIRST,
        )

    def _verify(self, answers: Answers) -> None:
        force = self.order.force_limit * FORCE_SHARE
        checks = (
            ("part_done", answers.part_done, self.order.part_number),
            ("force", round(answers.force, 3), round(force, 3)),
            ("cycles", answers.cycles, self._cycles_before + 1),
        )
        for name, found, wanted in checks:
            if found == wanted:
                self.verified += 1
            elif len(self.wrong) < CHECKS_PER_HANDSHAKE:
                self.wrong.append(f"{name} is {found}, expected {wanted}")


class Plc:
    """The scan cycle on a connection from `source`, an address of this machine by which the gateway knows the PLC."""

    def __init__(self, host: str, port: int, source: str) -> None:
        self.program = Program()
        self.connected = False
        self.refused = 0
        """Writes that were answered with an exception."""
        self._stopped = False
        self._client = AsyncModbusTcpClient(
            host,
            port=port,
            source_address=(source, 0),
            timeout=_TIMEOUT,
            retries=0,
            reconnect_delay=0,
        )

    def stop(self) -> None:
        """End `run` after the present scan. Cancelling alone is not enough: a connect that succeeds swallows it."""
        self._stopped = True

    async def run(self) -> None:
        """Scan until `stop`; a lost connection is made anew."""
        try:
            while not self._stopped:
                try:
                    self.connected = self._client.connected or await self._client.connect()
                    if self.connected:
                        await self._scan()
                    await asyncio.sleep(SCAN if self.connected else _PAUSE)
                except ModbusException:
                    self.connected = False
                    self._client.close()
                    await asyncio.sleep(_PAUSE)
        finally:
            self._client.close()

    async def _scan(self) -> None:
        answers = await self._read()
        order = self.program.scan(answers)
        if answers.alive:
            reply = await self._client.write_registers(_ORDER, order.words)
            self.refused += reply.isError()
            if order.slow:
                reply = await self._client.write_register(_FEED, SLOW_FEED)
                self.refused += reply.isError()

    async def _read(self) -> Answers:
        status = await self._registers(_STATUS, 2)
        words = await self._registers(_ANSWERS, _LAYOUT.size // 2)
        if not status or not words or status[1] & _FRESH_AND_WRITABLE != _FRESH_AND_WRITABLE:
            return Answers(alive=False)
        bits, part_done, cycles, force = _LAYOUT.unpack(struct.pack(f">{len(words)}H", *words))
        return Answers(True, bool(bits & 1), bool(bits & 2), part_done, cycles, force)

    async def _registers(self, address: int, count: int) -> Sequence[int]:
        """Holding registers; none if the gateway refuses."""
        reply = await self._client.read_holding_registers(address, count=count)
        return () if reply.isError() else reply.registers
