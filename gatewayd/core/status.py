"""The status block: what a PLC reads to know whether to believe the rest, and writes to take and release locks.

The block lies at fixed addresses, never derived from the map. All numbers are unsigned and big-endian; what takes
two words has the high word first. Variables and writers are counted from 1, 0 means none. Times saturate at the
greatest number of their width, which also stands for "never" (ages) and "no end" (leases).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum

from gatewayd.core.cell import Cell
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.program import STATES
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester

__all__ = [
    "BASE",
    "FIELDS",
    "LAYOUT_VERSION",
    "LENGTH",
    "MAX_VARIABLES",
    "MAX_WRITERS",
    "RELEASE",
    "RELEASE_ALL",
    "REQUEST",
    "TABLES",
    "StatusBlock",
    "StatusField",
    "StatusTable",
]

LAYOUT_VERSION = 1
BASE = 60000
"""Protocol address of the first word, in holding and in input registers."""
MAX_VARIABLES = 1024
MAX_WRITERS = 32
REQUEST = 40
"""Offset of the word into which a writer puts the number of a variable whose lock it wants."""
RELEASE = 41
"""Offset of the word into which a writer puts the number of a variable whose lock it gives back."""
RELEASE_ALL = 0xFFFF
"""Written to `RELEASE`: give back every lock I own."""

_U16 = 0xFFFF
_U32 = 0xFFFF_FFFF


def _numbered(numbers: Iterable[IntEnum]) -> str:
    return ", ".join(f"{number.value} {number.name.lower().replace('_', ' ')}" for number in numbers)


def _program_states() -> str:
    return ", ".join(f"{state + 1} {name}" for state, (name, _) in STATES.items())


@dataclass(frozen=True, slots=True)
class StatusField:
    """One number of the header, `offset` words after `BASE`, `words` long."""

    offset: int
    words: int
    name: str
    meaning: str


@dataclass(frozen=True, slots=True)
class StatusTable:
    """A table with one entry for each variable or writer, `offset` words after `BASE`."""

    offset: int
    words: int
    name: str
    meaning: str


FIELDS = (
    StatusField(0, 1, "layout", "version of this layout, 1"),
    StatusField(
        1,
        1,
        "flags",
        "bit 0 robot values fresh, 1 robot connected and writable, 2 every variable good, 3 some lock is owned, "
        "4 something was refused since the start, 5 read-back differed since the start, 6 robot watchdog is fed",
    ),
    StatusField(2, 2, "fingerprint", "32 bits that change with the meaning of the mapping"),
    StatusField(4, 1, "heartbeat", "counts up every 100 ms while the gateway lives, wraps"),
    StatusField(5, 1, "variables", "number of variables"),
    StatusField(6, 1, "writers", "number of declared writers"),
    StatusField(7, 1, "robot_state", _numbered(Source)),
    StatusField(8, 2, "uptime", "seconds since the gateway started"),
    StatusField(10, 2, "robot_age", "age of the newest package that reported anything new, in milliseconds"),
    StatusField(12, 1, "frequency", "packages per second, measured, in 0.1 Hz"),
    StatusField(13, 1, "sessions", "sessions with the controller since the start, wraps"),
    StatusField(14, 2, "packages", "packages received"),
    StatusField(16, 2, "skipped", "packages that the controller left out"),
    StatusField(18, 2, "late", "packages that came late"),
    StatusField(20, 2, "accepted", "write requests applied"),
    StatusField(22, 2, "refused", "requests refused"),
    StatusField(24, 2, "mismatches", "inputs whose read-back differed from what was written"),
    StatusField(26, 1, "modbus_connections", "open Modbus connections to this unit's listener"),
    StatusField(
        27, 1, "can_bus", "0 no CANopen, 1 absent, 2 down, 3 bus-off, 4 passive, 5 warning, 6 active"
    ),
    StatusField(28, 1, "nmt_state", "0 initialising, 4 stopped, 5 operational, 127 pre-operational"),
    StatusField(30, 1, "refusal_reason", "last refusal: " + ", ".join(f"{r.value} {r.text}" for r in Reason)),
    StatusField(31, 1, "refusal_variable", "number of the variable in the last refusal"),
    StatusField(
        32,
        1,
        "refusal_writer",
        "number of the writer that was refused; 0 if it is not declared, 255 the local operator",
    ),
    StatusField(33, 1, "refusal_holder", "number of the writer that held it; 255 the local operator"),
    StatusField(34, 2, "refusal_age", "milliseconds since the last refusal"),
    StatusField(REQUEST, 1, "request", "write a variable's number to take its lock; reads 0"),
    StatusField(
        RELEASE, 1, "release", "write a variable's number to give its lock back, 65535 for all; reads 0"
    ),
    StatusField(42, 1, "unadopted", "inputs whose content in the robot is not known"),
    StatusField(43, 1, "differing", "inputs for which the robot holds something else than it was given"),
    StatusField(
        44,
        2,
        "lag",
        "milliseconds by which the newest package came later than the quickest ones; part of ages",
    ),
    StatusField(
        46,
        1,
        "adoption",
        "seconds until adopted inputs that nobody owns fall back; 0: they have, or never will",
    ),
    StatusField(47, 1, "program", f"state of the robot program: 0 unknown, {_program_states()}"),
    StatusField(48, 1, "gaps", "times that the gateway stood still, wraps"),
)
HEADER_WORDS = 64
TABLES = (
    StatusTable(
        64, 64, "good", "one bit for each variable, 1 = good; variable n is bit (n-1)%16 of word (n-1)/16"
    ),
    StatusTable(128, 64, "writers_alive", "one word for each writer: 1 = connected and heard in time"),
    StatusTable(
        192,
        MAX_VARIABLES,
        "owner",
        "one word for each variable: number of the writer that owns it; 255 the local operator",
    ),
    StatusTable(
        1216, MAX_VARIABLES, "lease", "one word for each variable: milliseconds of its owner's lease left"
    ),
    StatusTable(2240, MAX_VARIABLES, "age", "one word for each variable: age of its value in milliseconds"),
    StatusTable(
        3264,
        MAX_VARIABLES,
        "quality",
        f"one word for each variable: {_numbered(Quality)}",
    ),
)
LENGTH = 4288
"""Words of the whole block."""

_HEADER = struct.Struct(">HHIHHHHIIHHIIIIIIHHH2xHHHHI8x4xHHIHHH")
"""The fields of the header in order; what lies between them, `request` and `release` among it, reads 0."""


_Entries = Callable[[range, float], Iterable[int]]
"""The words of some entries of a table at one time."""


class StatusBlock:
    """The status block of one cell."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        variables, writers = len(cell.definition.variables), len(cell.definition.writers)
        good, alive, owner, lease, age, quality = TABLES
        self._tables: tuple[tuple[int, int, _Entries], ...] = (
            (good.offset, -(-variables // 16), self._good),
            (alive.offset, writers, self._writers_alive),
            (owner.offset, variables, self._owner),
            (lease.offset, variables, self._lease),
            (age.offset, variables, self._age),
            (quality.offset, variables, self._quality),
        )

    def read(self, first: int, count: int, now: float) -> bytes:
        """`count` words from offset `first` (0 = address `BASE`), big-endian, all of one moment.

        The caller has checked that the range lies within `LENGTH`.
        """
        block = bytearray(2 * count)
        end = first + count
        if first < HEADER_WORDS:
            header = self._header(now)[2 * first : 2 * end]
            block[: len(header)] = header
        for offset, length, words in self._tables:
            low, high = max(first, offset), min(end, offset + length)
            if low < high:
                encoded = struct.pack(f">{high - low}H", *words(range(low - offset, high - offset), now))
                block[2 * (low - first) : 2 * (high - first)] = encoded
        return bytes(block)

    def write(
        self,
        requester: Requester,
        first: int,
        words: Sequence[int],
        now: float,
    ) -> Refusal | None:
        """A writer takes or gives back a lock; any other word of the block is never writable.

        A request that fills both words is refused, because it could succeed by half.
        """
        cell = self._cell
        if requester.writer is None or first < REQUEST or first + len(words) > RELEASE + 1:
            return self._refuse(requester, Refusal(Reason.NOT_WRITABLE), now)
        wanted = [(offset, number) for offset, number in enumerate(words, first) if number]
        if not wanted:
            return None
        offset, number = wanted[0]
        if offset == RELEASE and number == RELEASE_ALL:
            if not requester.trusted:
                return self._refuse(requester, Refusal(Reason.HEARTBEAT_LOST), now)
            cell.release_all(requester, now)
            return None
        if len(wanted) > 1 or number > len(cell.definition.variables):
            return self._refuse(requester, Refusal(Reason.OUT_OF_LIMITS), now)
        act = cell.request if offset == REQUEST else cell.release
        return act(requester, number - 1, now)

    def _refuse(self, requester: Requester, refusal: Refusal, now: float) -> Refusal:
        self._cell.refuse(requester, refusal, now)
        return refusal

    def _header(self, now: float) -> bytes:
        cell, health = self._cell, self._cell.health
        last = cell.last_refusal
        refusal = last.refusal if last is not None else None
        return _HEADER.pack(
            LAYOUT_VERSION,
            self._flags(),
            cell.definition.fingerprint,
            health.heartbeat & _U16,
            len(cell.definition.variables),
            len(cell.definition.writers),
            cell.freshness.state,
            int(max(0.0, now - health.started)) & _U32,
            _milliseconds(now - cell.freshness.last_progress, _U32),
            min(_U16, round(health.frequency * 10)),
            health.sessions & _U16,
            health.packages & _U32,
            health.skipped & _U32,
            health.late & _U32,
            health.writes_accepted & _U32,
            health.writes_refused & _U32,
            health.read_back_mismatches & _U32,
            min(_U16, health.modbus_connections),
            health.can_bus,
            health.nmt_state,
            refusal.reason if refusal is not None else 0,
            _number(refusal.variable) if refusal is not None else 0,
            _number(last.writer) if last is not None else 0,
            _number(refusal.holder) if refusal is not None else 0,
            _milliseconds(now - last.time, _U32) if last is not None else _U32,
            min(_U16, health.unadopted),
            min(_U16, health.differing),
            _milliseconds(health.lag, _U32),
            min(_U16, math.ceil(health.adoption)),
            0 if health.program is None else min(_U16, health.program + 1),
            health.gaps & _U16,
        )

    def _flags(self) -> int:
        cell, health = self._cell, self._cell.health
        flags = (
            cell.freshness.state is Source.FRESH,
            cell.accepts_writes,
            cell.image.quality.count(Quality.GOOD) == len(cell.image.quality),
            cell.ownership.owners.count(None) < len(cell.ownership.owners),
            health.writes_refused > 0,
            health.read_back_mismatches > 0,
            health.watchdog_fed,
        )
        return sum(1 << bit for bit, flag in enumerate(flags) if flag)

    def _good(self, entries: range, _now: float) -> Iterable[int]:
        quality = self._cell.image.quality
        for entry in entries:
            word = quality[16 * entry : 16 * entry + 16]
            yield sum(1 << bit for bit, one in enumerate(word) if one is Quality.GOOD)

    def _writers_alive(self, entries: range, _now: float) -> Iterable[int]:
        return map(self._cell.writers.alive.__getitem__, entries)

    def _owner(self, entries: range, _now: float) -> Iterable[int]:
        owners = self._cell.ownership.owners
        for lock in self._locks(entries):
            yield _number(owners[lock]) if lock is not None else 0

    def _lease(self, entries: range, now: float) -> Iterable[int]:
        remaining = self._cell.ownership.remaining
        for lock in self._locks(entries):
            yield _milliseconds(remaining(lock, now), _U16) if lock is not None else 0

    def _age(self, entries: range, now: float) -> Iterable[int]:
        age = self._cell.image.age
        return (_milliseconds(age(index, now), _U16) for index in entries)

    def _quality(self, entries: range, _now: float) -> Iterable[int]:
        return map(self._cell.image.quality.__getitem__, entries)

    def _locks(self, entries: range) -> Iterable[int | None]:
        variables = self._cell.definition.variables
        return (variables[index].lock for index in entries)


def _milliseconds(seconds: float, greatest: int) -> int:
    return int(min(max(0.0, seconds * 1000), greatest))


def _number(index: int | None) -> int:
    return 0 if index is None else index + 1
