"""The status block: what a PLC reads to know whether to believe the rest, and writes to take and release locks.

The block lies at fixed addresses, never derived from the map. All numbers are unsigned and big-endian; what takes
two words has the high word first. Variables and writers are counted from 1, 0 means none. Times saturate at the
greatest number of their width, which also stands for "never" (ages) and "no end" (leases).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from operator import itemgetter

from gatewayd.core.cell import Cell
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.core.status_layout import (
    BASE,
    FIELDS,
    HEADER_WORDS,
    LAYOUT_VERSION,
    RELEASE,
    RELEASE_ALL,
    REQUEST,
    TABLES,
    LinkTable,
    StatusField,
)

_U16 = 0xFFFF
_U32 = 0xFFFF_FFFF
_CODES = {1: "H", 2: "I"}
"""By words of a field."""
_MAX = {1: _U16, 2: _U32}

_WRITABLE = f"a writer may write {BASE + REQUEST} and {BASE + RELEASE}, the requests for locks"

_Entries = Callable[[range, float], Iterable[int]]
"""The words of some entries of a table at one time."""


class StatusBlock:
    """The status block of one cell. `fields` are the core's and those whose numbers are in `Cell.health.words`.

    `tables` are those whose entries are in `Cell.health.tables`.
    """

    def __init__(
        self, cell: Cell, fields: Sequence[StatusField] = FIELDS, tables: Sequence[LinkTable] = ()
    ) -> None:
        self._cell = cell
        self._words = [field for field in fields if field not in FIELDS]
        numbers = {field.name: number for number, field in enumerate((*FIELDS, *self._words))}
        in_order = sorted(fields, key=lambda field: field.offset)
        self._in_order = itemgetter(*(numbers[field.name] for field in in_order))
        self._pack = struct.Struct(_format(in_order)).pack
        variables, writers = len(cell.definition.variables), len(cell.definition.writers)
        good, alive, owner, lease, age, quality = TABLES
        self._tables: tuple[tuple[int, int, _Entries], ...] = (
            (good.offset, -(-variables // 16), self._good),
            (alive.offset, writers, self._writers_alive),
            (owner.offset, variables, self._owner),
            (lease.offset, variables, self._lease),
            (age.offset, variables, self._age),
            (quality.offset, variables, self._quality),
            *((table.offset, table.words, partial(self._reported, table)) for table in tables),
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

    def write(self, requester: Requester, first: int, words: Sequence[int], now: float) -> Refusal | None:
        """A writer takes or gives back a lock; any other word of the block is never writable.

        A request that fills both words is refused, because it could succeed by half.
        """
        cell = self._cell
        asked = f"wrote {_span(first, len(words))}"
        if requester.writer is None or first < REQUEST or first + len(words) > RELEASE + 1:
            return self._refuse(requester, Refusal(Reason.NOT_WRITABLE, request=asked, hint=_WRITABLE), now)
        wanted = [(offset, number) for offset, number in enumerate(words, first) if number]
        if not wanted:
            return None
        offset, number = wanted[0]
        if offset == RELEASE and number == RELEASE_ALL:
            if not requester.trusted:
                return self._refuse(requester, Refusal(Reason.HEARTBEAT_LOST, request=asked), now)
            cell.release_all(requester, now)
            return None
        last = len(cell.definition.variables)
        if len(wanted) > 1 or number > last:
            hint = "one lock at a time" if len(wanted) > 1 else f"variables are 1 to {last}, not {number}"
            return self._refuse(requester, Refusal(Reason.OUT_OF_LIMITS, request=asked, hint=hint), now)
        cell.health.lock_requests += 1
        act = cell.request if offset == REQUEST else cell.release
        return act(requester, number - 1, now)

    def _refuse(self, requester: Requester, refusal: Refusal, now: float) -> Refusal:
        self._cell.refuse(requester, refusal, now)
        return refusal

    def _header(self, now: float) -> bytes:
        cell, health = self._cell, self._cell.health
        last = cell.last_refusal
        refusal = last.refusal if last is not None else None
        own = (
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
            refusal.reason if refusal is not None else 0,
            _number(refusal.variable) if refusal is not None else 0,
            _number(last.writer) if last is not None else 0,
            _number(refusal.holder) if refusal is not None else 0,
            _milliseconds(now - last.time, _U32) if last is not None else _U32,
            0,
            0,
            min(_U16, health.unadopted),
            min(_U16, health.differing),
            _milliseconds(health.lag, _U32),
            min(_U16, math.ceil(health.adoption)),
            0 if health.program is None else min(_U16, health.program + 1),
            health.gaps & _U16,
            sum(health.unserved.values()) & _U32,
            0 if cell.last_unserved is None else cell.last_unserved.reason or 0,
        )
        words = health.words
        others = (min(_MAX[field.words], words.get(field.name, 0)) for field in self._words)
        return self._pack(*self._in_order((*own, *others)))

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
            yield sum(1 << bit for bit, its in enumerate(word) if its is Quality.GOOD)

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

    def _reported(self, table: LinkTable, entries: range, _now: float) -> Iterable[int]:
        found, width = self._cell.health.tables.get(table.name, {}), len(table.entry)
        nothing = (0,) * width
        return (min(_U16, found.get(word // width, nothing)[word % width]) for word in entries)

    def _locks(self, entries: range) -> Iterable[int | None]:
        variables = self._cell.definition.variables
        return (variables[index].lock for index in entries)


def _format(fields: Iterable[StatusField]) -> str:
    """What lies between the fields reads 0."""
    found, end = ">", 0
    for field in fields:
        found += f"{2 * (field.offset - end)}x{_CODES[field.words]}"
        end = field.offset + field.words
    return found


def _span(first: int, count: int) -> str:
    """Words of the block by the addresses that are documented for them."""
    last = BASE + first + count - 1
    return f"the status block at {BASE + first}" + (f"-{last}" if count > 1 else "")


def _milliseconds(seconds: float, limit: int) -> int:
    return int(min(max(0.0, seconds * 1000), limit))


def _number(index: int | None) -> int:
    return 0 if index is None else index + 1
