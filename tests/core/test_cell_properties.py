"""Any interleaving of what links, writers and time do to a cell, against a second, naive account of the same rules."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import replace

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Limits,
    Lock,
    Value,
    ValueKind,
    Variable,
    Writer,
)
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.prepared import PreparedWrite
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import LENGTH, RELEASE, RELEASE_ALL, REQUEST

CLEAR, HOLD = Fallback(), Fallback(FallbackKind.HOLD)
LOW, HIGH = -(2.0**31), 2.0**31 - 1


def _bit(number: int, lock: int | None, on_release: Fallback = CLEAR) -> Variable:
    field = "input_bit_registers0_to_31"
    return Variable(
        number,
        f"bit{number}",
        Direction.INPUT,
        ValueKind.BOOL,
        field,
        bit=number,
        on_release=on_release,
        lock=lock,
    )


def _value(number: int, kind: ValueKind, lock: int, on_release: Fallback, limits: Limits | None) -> Variable:
    low, high = (LOW, HIGH) if kind is ValueKind.INT else (None, None)
    return Variable(
        number,
        f"value{number}",
        Direction.INPUT,
        kind,
        f"field{number}",
        low=low,
        high=high,
        on_release=on_release,
        limits=limits,
        lock=lock,
    )


def _output(number: int, kind: ValueKind, on_stale: Fallback) -> Variable:
    return Variable(number, f"out{number}", Direction.OUTPUT, kind, f"out{number}", on_stale=on_stale)


INT, FLOAT, BOOL = ValueKind.INT, ValueKind.FLOAT, ValueKind.BOOL
DEFINITION = CellDefinition(
    name="any",
    fingerprint=0xDEADBEEF,
    variables=(
        _bit(1, 0),
        _bit(2, 1),
        _bit(3, 2, HOLD),
        _bit(4, 3, Fallback(FallbackKind.VALUE, value=True)),
        _value(5, INT, 4, CLEAR, Limits(-5.5, 10.5, clamp=True)),
        _value(6, FLOAT, 4, Fallback(FallbackKind.VALUE, 1.5), None),
        _value(7, FLOAT, 5, HOLD, Limits(-1.0, 1.0)),
        _value(8, INT, 6, Fallback(FallbackKind.VALUE, 1), None),
        _output(9, INT, CLEAR),
        _output(10, FLOAT, HOLD),
        _output(11, INT, Fallback(FallbackKind.VALUE, -1)),
        _output(12, BOOL, Fallback(FallbackKind.EXCEPTION)),
    ),
    locks=(
        Lock("fixed", (0,), (0,)),
        Lock("priority", (1,), (0, 1, 2), takeover=True, lease=0.5),
        Lock("list", (2,), (1, 0), lease=0.5),
        Lock("any", (3,), (0, 1, 2, 3), lease=1.0),
        Lock("group", (4, 5), (2, 1, 0), takeover=True, lease=0.75, whole=True),
        Lock("endless", (6,), (3, 2)),
        Lock("single", (7,), (3,), lease=0.25),
    ),
    writers=(
        Writer("a", grace=0.5),
        Writer("b", 0.5, grace=0.25),
        Writer("c", 0.25, counts_writes=True),
        Writer("d", heartbeat=0.75),
    ),
    stale_after=0.25,
)
VARIABLES = DEFINITION.variables
LOCKS = DEFINITION.locks
INPUTS = [n for n, one in enumerate(VARIABLES) if one.direction is Direction.INPUT]
OUTPUTS = [n for n, one in enumerate(VARIABLES) if one.direction is Direction.OUTPUT]
OUTPUTS_SET = set(OUTPUTS)
BITS = [0, 1, 2, 3]
SUPERVISED = {0: [], 1: [0.5], 2: [0.25], 3: [0.75]}
"""How long each writer may be silent."""
LOCK_OF = {member: number for number, lock in enumerate(LOCKS) for member in lock.members}
TELLING_ORDER = [
    Reason.NOT_WRITABLE,
    Reason.OUT_OF_LIMITS,
    Reason.HEARTBEAT_LOST,
    Reason.WAITED,
    Reason.ROBOT_LOST,
    Reason.CLAIMED_ELSEWHERE,
    Reason.PARTIAL_TAKEOVER,
    Reason.HELD,
    Reason.NOT_MEANT,
]

writers = st.integers(0, 3)
mostly = st.sampled_from([True, True, True, False])
anybody = st.one_of(st.none(), writers)
steps = st.sampled_from([0.0, 0.125, 0.25, 0.5])
lines = st.integers(0, 2)
waits = st.sampled_from([0.0, 0.0, 0.0, 0.0, 0.25, 0.375, 0.625, 0.875])
numbers = st.sampled_from([0, 1, -6, -5, 10, 11, 2**31 - 1, 2**31, True, 1.0, 1.5, math.nan])
reals = st.sampled_from([0.0, -0.0, 1, True, 1.0, 1.5, -1.0, 1.0000001, math.inf, math.nan])
VALUES = {BOOL: st.booleans(), INT: numbers, FLOAT: reals}
HELD_VALUES = {BOOL: st.booleans(), INT: st.integers(-20, 20), FLOAT: st.floats(-2, 2)}


@st.composite
def changes(draw: st.DrawFn) -> list[Change]:
    """Up to five variables, outputs too; or all bits of the word, implied as by writing its register."""
    if draw(st.booleans()):
        return [Change(bit, draw(st.booleans()), implied=True) for bit in BITS]
    chosen = draw(st.lists(st.integers(0, len(VARIABLES) - 1), min_size=1, max_size=5))
    return [Change(index, draw(VALUES[VARIABLES[index].kind]), draw(st.booleans())) for index in chosen]


def adoptions() -> st.SearchStrategy[dict[int, Value]]:
    return st.fixed_dictionaries({}, optional={index: HELD_VALUES[VARIABLES[index].kind] for index in INPUTS})


def requester(writer: int | None, line: int, *, trusted: bool = True, waited: float = 0.0) -> Requester:
    """By one of the writer's two connections, or by none (0)."""
    number = 0 if writer is None or not line else 10 * (writer + 1) + line
    return Requester(writer, connection=number, trusted=trusted, waited=waited)


def same(left: Value, right: Value) -> bool:
    """Equal, and of one type: the gateway must not turn True into 1, nor lose a NaN."""
    return type(left) is type(right) and (left == right or (left != left and right != right))  # noqa: PLR0124


def is_int32(value: Value) -> bool:
    try:
        struct.pack("i", value if isinstance(value, int) else value.as_integer_ratio()[0])
    except (struct.error, OverflowError, ValueError):
        return False
    return isinstance(value, int) or value.is_integer()


class Model:
    """The same rules, told as plainly as possible: every question is answered by looking at everything."""

    def __init__(self, *, clear_on_connect: bool) -> None:
        self.clear_on_connect = clear_on_connect
        self.owner: dict[int, int | None] = dict.fromkeys(range(len(LOCKS)))
        self.until: dict[int, float] = dict.fromkeys(range(len(LOCKS)), math.inf)
        self.value: dict[int, Value] = {n: (False, 0, 0.0)[one.kind] for n, one in enumerate(VARIABLES)}
        self.value[10] = -1
        self.told: dict[int, float] = dict.fromkeys(range(len(VARIABLES)), -math.inf)
        self.good: set[int] = set()
        self.ever: set[int] = set()
        self.gone: set[int] = set()
        self.due: set[int] = set()
        self.under_way: set[int] = set()
        self.entered: set[int] = set()
        self.given: set[int] = set()
        """Inputs that got their value in this session, written or as a fallback."""
        self.connections: Counter[int] = Counter()
        self.worked: dict[int, int] = {}
        """By which connection the owner of a lock last worked with it."""
        self.abandoned: dict[int, float] = {}
        """Locks whose connection has ended, and when."""
        self.parted: dict[int, float] = {}
        """Writers whose last connection has ended, and when."""
        self.alive: set[int] = set()
        self.heard: dict[int, float] = {}
        self.connected = self.adopted = False
        self.source = Source.LOST
        self.timestamp: float | None = None
        self.last_package = self.last_progress = self.shown = -math.inf
        self.accepted = self.refused = self.packages = self.sessions = 0
        self.events: Counter[EventKind] = Counter()
        self.last: tuple[Refusal, int | None, float] | None = None

    # Owners.

    def may(self, writer: int | None, index: int) -> bool:
        return writer is not None and index in LOCK_OF and writer in LOCKS[LOCK_OF[index]].owners

    def outranks(self, writer: int, lock: int) -> bool:
        ranking, owner = LOCKS[lock].owners, self.owner[lock]
        assert owner is not None
        return LOCKS[lock].takeover and ranking.index(writer) < ranking.index(owner)

    def own(self, lock: int, by: Requester, now: float, written: Collection[int] = ()) -> None:
        writer, former = by.writer, self.owner[lock]
        assert writer is not None
        if former is None:
            self.events[EventKind.ACQUIRED] += 1
            inherited = set(LOCKS[lock].members) - self.given if lock == 4 else set()
        elif former != writer:
            self.events[EventKind.TAKEN_OVER] += 1
            inherited = set(LOCKS[lock].members)
        else:
            inherited = set()
        for index in inherited.difference(written):
            self.fall_back(index, now)
        self.owner[lock], self.worked[lock] = writer, by.connection
        self.abandoned.pop(lock, None)
        lease = LOCKS[lock].lease
        self.until[lock] = math.inf if lease is None else now + lease

    def free(self, lock: int, now: float) -> None:
        self.events[EventKind.RELEASED] += 1
        self.owner[lock], self.until[lock] = None, math.inf
        self.worked.pop(lock, None)
        self.abandoned.pop(lock, None)
        for index in LOCKS[lock].members:
            self.fall_back(index, now)

    def expire(self, now: float) -> None:
        for lock in range(len(LOCKS)):
            if self.owner[lock] is not None and now >= self.until[lock]:
                self.free(lock, now)
        for writer, since in list(self.parted.items()):
            if now >= since + DEFINITION.writers[writer].grace:
                self.lose(writer, now)
        for lock, since in list(self.abandoned.items()):
            owner = self.owner[lock]
            assert owner is not None
            if now >= since + DEFINITION.writers[owner].grace:
                self.free(lock, now)

    def lose(self, writer: int, now: float) -> None:
        if writer in self.alive:
            self.alive.discard(writer)
            self.parted.pop(writer, None)
            self.events[EventKind.WRITER_LOST] += 1
            for lock in range(len(LOCKS)):
                if self.owner[lock] == writer:
                    self.free(lock, now)

    def hear(self, by: Requester, now: float, *, wrote: bool = False, owns: bool = False) -> None:
        writer = by.writer
        if writer is None or not by.trusted or (self.too_old(by, []) and not owns):
            return
        if writer == 2 and not wrote:
            return
        self.heard[writer] = now
        if writer not in self.alive:
            self.alive.add(writer)
            self.events[EventKind.WRITER_CONNECTED] += 1

    def too_old(self, by: Requester, locks: list[int]) -> bool:
        """Whether its writer, silent for so long, would have lost something by it."""
        limits = list(SUPERVISED[by.writer]) if by.writer is not None else []
        limits += [lease for lock in locks if (lease := LOCKS[lock].lease) is not None]
        return by.waited > min(limits, default=0.5)

    def connect_writer(self, by: Requester, now: float) -> None:
        assert by.writer is not None
        self.connections[by.writer] += 1
        self.parted.pop(by.writer, None)
        self.hear(by, now)

    def disconnect_writer(self, by: Requester, now: float, *, at_once: bool) -> None:
        writer = by.writer
        assert writer is not None
        self.connections[writer] = max(0, self.connections[writer] - 1)
        patient = DEFINITION.writers[writer].grace > 0 and not at_once
        if not self.connections[writer] and writer in self.alive:
            if patient:
                self.parted[writer] = now
            else:
                self.lose(writer, now)
        for lock in range(len(LOCKS)):
            if self.owner[lock] == writer and by.connection and self.worked[lock] == by.connection:
                if patient:
                    self.abandoned[lock] = now
                else:
                    self.free(lock, now)

    def stand_still(self, since: float, now: float) -> None:
        """Of what waits, nothing counts against a writer."""
        for writer in range(4):
            leases = [lock.lease for lock in LOCKS if writer in lock.owners and lock.lease is not None]
            anew = now - since > min([*SUPERVISED[writer], *leases])
            if writer in self.heard:
                self.heard[writer] = now if anew else min(now, self.heard[writer] + (now - since))
            if writer in self.parted:
                self.parted[writer] = now if anew else self.parted[writer] + (now - since)
            for lock in self.abandoned:
                if self.owner[lock] == writer:
                    self.abandoned[lock] = now if anew else self.abandoned[lock] + (now - since)

    # Values.

    def put(self, index: int, value: Value, now: float) -> None:
        self.value[index], self.told[index] = value, now
        self.ever.add(index)
        if index not in self.gone:
            self.good.add(index)

    def fall_back(self, index: int, now: float) -> None:
        if not self.adopted or index in self.gone:
            self.due.add(index)
            return
        self.due.discard(index)
        policy = VARIABLES[index].on_release
        if policy.kind is FallbackKind.HOLD:
            return
        new = (False, 0, 0.0)[VARIABLES[index].kind] if policy.kind is FallbackKind.CLEAR else policy.value
        assert new is not None
        if self.value[index] != new:
            self.events[EventKind.FALLBACK] += 1
        self.put(index, new, now)
        self.given.add(index)
        self.under_way.add(index)

    def fits(self, index: int, value: Value) -> Value | None:
        if index == 4:
            return min(max(int(value), -5), 10) if is_int32(value) else None
        if index == 6:
            return value if -1 <= value <= 1 else None
        if index == 7:
            return int(value) if is_int32(value) else None
        return value

    def judge(self, writer: int | None, change: Change) -> Refusal | None:
        """None if nothing about this one change stands in the way."""
        index = change.variable
        if writer is None:
            return Refusal(Reason.NOT_WRITABLE, index)
        if self.passes(writer, change):
            return None
        if not self.may(writer, index):
            return Refusal(Reason.NOT_WRITABLE, index)
        if self.fits(index, change.value) is None:
            return Refusal(Reason.OUT_OF_LIMITS, index)
        if not self.adopted:
            return Refusal(Reason.ROBOT_LOST, index)
        if index in self.gone:
            return None if self.untouched(change) else Refusal(Reason.CLAIMED_ELSEWHERE, index)
        lock = LOCK_OF[index]
        holder = self.owner[lock]
        if holder not in (None, writer) and not self.outranks(writer, lock):
            return Refusal(Reason.HELD, index, holder)
        return None if self.means(writer, change) else Refusal(Reason.NOT_MEANT, index)

    def untouched(self, change: Change) -> bool:
        return change.implied and change.value == self.value[change.variable]

    def means(self, writer: int, change: Change) -> bool:
        """Whether the writer knows that it writes this bit: it owns it, or nobody else ever could."""
        if not change.implied:
            return True
        index = change.variable
        if not self.may(writer, index):
            return False
        lock = LOCK_OF[index]
        return self.owner[lock] == writer or (self.owner[lock] is None and LOCKS[lock].owners == (writer,))

    def passes(self, writer: int, change: Change) -> bool:
        """An implied bit that keeps its value, and that the writer does not mean."""
        return self.untouched(change) and not self.means(writer, change)

    def moved(self, writer: int, request: list[Change]) -> set[int]:
        """The locks that the request would acquire, renew or take over, by what it writes."""
        return {
            LOCK_OF[change.variable]
            for change in request
            if not self.passes(writer, change)
            and self.may(writer, change.variable)
            and self.fits(change.variable, change.value) is not None
            and (
                self.owner[LOCK_OF[change.variable]] == writer
                or (self.adopted and change.variable not in self.gone and self.judge(writer, change) is None)
            )
        }

    def partial(self, writer: int, request: list[Change]) -> Refusal | None:
        """Of the locks only the group is taken over whole or not at all."""
        written = [
            change.variable
            for change in request
            if change.variable in (4, 5)
            and change.variable not in self.gone
            and self.adopted
            and not self.passes(writer, change)
            and self.judge(writer, change) is None
        ]
        if written and self.owner[4] not in (None, writer) and set(written) != {4, 5}:
            return Refusal(Reason.PARTIAL_TAKEOVER, written[0])
        return None

    def write(self, by: Requester, request: list[Change], now: float) -> Refusal | None:
        self.expire(now)
        writer = by.writer
        refusals = [refusal for change in request if (refusal := self.judge(writer, change)) is not None]
        if writer is not None and (partial := self.partial(writer, request)) is not None:
            refusals.append(partial)
        if not by.trusted:
            refusals.append(Refusal(Reason.HEARTBEAT_LOST, request[0].variable))
        if writer is not None and self.too_old(by, list(self.moved(writer, request))):
            refusals.append(Refusal(Reason.WAITED, request[0].variable))
        refusal = min(refusals, key=lambda one: TELLING_ORDER.index(one.reason), default=None)
        if refusal is None or refusal.reason is not Reason.WAITED:
            self.hear(by, now, wrote=True, owns=refusal is None)
        if refusal is None:
            self.carry_out(by, request, now)
            return None
        if refusal.reason is Reason.ROBOT_LOST and writer is not None:
            for lock in self.moved(writer, request):
                if self.owner[lock] == writer:
                    self.own(lock, by, now)
        return self.refuse(writer, refusal, now)

    def carry_out(self, by: Requester, request: list[Change], now: float) -> None:
        assert by.writer is not None
        written = [change for change in request if not self.passes(by.writer, change)]
        given = {change.variable for change in written if change.variable not in self.gone}
        for change in written:
            lock = LOCK_OF[change.variable]
            if change.variable not in self.gone or self.owner[lock] == by.writer:
                self.own(lock, by, now, given)
        for change in written:
            if change.variable not in self.gone:
                value = self.fits(change.variable, change.value)
                assert value is not None
                self.due.discard(change.variable)
                self.under_way.discard(change.variable)
                self.given.add(change.variable)
                self.put(change.variable, value, now)
        self.accepted += 1

    def refuse(self, writer: int | None, refusal: Refusal, now: float) -> Refusal:
        self.refused += 1
        self.last = (refusal, writer, now)
        return refusal

    def act(self, by: Requester, index: int, now: float, *, take: bool) -> Refusal | None:
        self.expire(now)
        writer = by.writer
        if writer is None or not self.may(writer, index):
            self.hear(by, now, wrote=True)
            return self.refuse(writer, Refusal(Reason.NOT_WRITABLE, index), now)
        if not by.trusted:
            return self.refuse(writer, Refusal(Reason.HEARTBEAT_LOST, index), now)
        lock = LOCK_OF[index]
        holder = self.owner[lock]
        possible = holder in (None, writer) or (take and self.outranks(writer, lock))
        if take and self.too_old(by, [lock] if possible else []):
            return self.refuse(writer, Refusal(Reason.WAITED, index), now)
        self.hear(by, now, wrote=True, owns=possible and take)
        if not possible:
            return self.refuse(writer, Refusal(Reason.HELD, index, holder), now)
        if take:
            self.own(lock, by, now)
        elif holder == writer:
            self.free(lock, now)
        return None

    def drop(self, writer: int, indices: list[int], now: float) -> None:
        for lock in {LOCK_OF[index] for index in indices if index in LOCK_OF}:
            if self.owner[lock] == writer:
                self.free(lock, now)

    # The robot.

    def dim(self) -> None:
        """The outputs are dead."""
        for index in OUTPUTS:
            self.good.discard(index)
            self.show_policy(index)

    def show_policy(self, index: int) -> None:
        if index in (8, 10):
            self.value[index] = {8: 0, 10: -1}[index]

    def connect(self, now: float) -> None:
        self.disconnect(now)
        self.connected, self.source = True, Source.WAITING
        self.sessions += 1
        self.events[EventKind.ROBOT_CONNECTED] += 1

    def disconnect(self, now: float) -> None:
        if self.connected:
            self.connected = self.adopted = False
            self.source = Source.LOST
            self.good -= set(INPUTS)
            self.due |= self.under_way
            self.under_way.clear()
            self.entered.clear()
            self.given.clear()
            self.dim()
            self.events[EventKind.ROBOT_LOST] += 1

    def package(self, timestamp: float, now: float) -> bool:
        if not self.connected:
            return False
        self.packages += 1
        self.last_package = now
        if timestamp == self.timestamp:
            if self.source is Source.WAITING:
                self.source = Source.FROZEN
            return False
        self.timestamp, self.last_progress = timestamp, now
        if self.source is not Source.FRESH:
            self.source = Source.FRESH
            self.events[EventKind.FRESH] += 1
        return True

    def show(self, values: dict[int, Value], now: float) -> None:
        self.value.update(values)
        self.shown = now
        self.good.update(set(OUTPUTS) - self.gone)
        self.ever.update(set(OUTPUTS) - self.gone)

    def adopt(self, held: dict[int, Value], now: float) -> None:
        if not self.connected:
            return
        first, self.adopted = not self.adopted, True
        for index, value in held.items():
            self.put(index, value, now)
        self.events[EventKind.INPUTS_ADOPTED] += first
        new = set(INPUTS) - self.gone - self.entered
        self.entered |= new
        for index in INPUTS:
            ownerless = self.owner[LOCK_OF[index]] is None and index not in self.gone
            if index in self.due or (self.clear_on_connect and ownerless and (index in new or index in held)):
                self.fall_back(index, now)

    def set_gone(self, index: int, *, gone: bool) -> None:
        if gone == (index in self.gone):
            return
        self.events[EventKind.UNAVAILABLE if gone else EventKind.AVAILABLE] += 1
        self.gone ^= {index}
        if gone:
            self.good.discard(index)
            self.entered.discard(index)
            self.given.discard(index)
            if index in self.under_way:
                self.under_way.discard(index)
                self.due.add(index)
        if index in OUTPUTS:
            self.ever.discard(index)
            self.show_policy(index)

    def tick(self, now: float) -> None:
        self.expire(now)
        for writer in sorted(self.alive):
            timeout = DEFINITION.writers[writer].timeout
            if timeout is not None and now - self.heard[writer] > timeout:
                self.lose(writer, now)
        if self.source not in (Source.LOST, Source.WAITING) and now - self.last_progress > 0.25:
            if self.source is Source.FRESH:
                self.events[EventKind.STALE] += 1
            self.dim()
            self.source = Source.SILENT if now - self.last_package > 0.25 else Source.FROZEN

    def quality(self, index: int) -> Quality:
        if index in self.gone:
            return Quality.UNAVAILABLE
        if index in self.good:
            return Quality.GOOD
        return Quality.STALE if index in self.ever else Quality.NEVER

    def time_of(self, index: int) -> float:
        if index in INPUTS:
            return self.told[index]
        return self.shown if index in self.ever and index not in self.gone else -math.inf


class CellMachine(RuleBasedStateMachine):
    """Drives a cell and its model alike; every rule is one thing that a link, a writer or the clock can do."""

    @initialize(clear=st.booleans(), up=st.booleans())
    def begin(self, clear: bool, up: bool) -> None:
        self.cell = Cell(replace(DEFINITION, clear_on_connect=clear))
        self.model = Model(clear_on_connect=clear)
        self.status = StatusBlock(self.cell)
        self.now = 1000.0
        self.timestamp = 0.0
        self.beats_due = self.ticked = 0
        self.prepared: dict[tuple[int, ...], PreparedWrite] = {}
        if up:
            self.robot_connects()
            self.robot_adopts({})

    def both(self, act: Callable[[Cell], object], told: Callable[[Model], object]) -> None:
        assert act(self.cell) == told(self.model)

    # Time.

    @rule(step=steps)
    def time_passes(self, step: float) -> None:
        self.now += step

    @rule()
    def tick(self) -> None:
        before = self.cell.health.heartbeat
        self.cell.tick(self.now)
        self.model.tick(self.now)
        assert before <= self.cell.health.heartbeat <= before + 1
        self.ticked += self.cell.health.heartbeat - before
        assert not self.ended_leases()

    @rule(length=st.sampled_from([0.125, 0.25, 0.375, 0.625, 0.875]))
    def stands_still(self, length: float) -> None:
        since, self.now = self.now, self.now + length
        before = self.cell.health.heartbeat
        self.cell.gap(since, self.now)
        self.model.events[EventKind.STOOD_STILL] += length >= 0.5
        self.model.stand_still(since, self.now)
        self.model.tick(self.now)
        self.ticked += self.cell.health.heartbeat - before

    # Writers. Each has two connections and sometimes none.

    @rule(writer=anybody, request=changes(), trusted=mostly, line=lines, waited=waits)
    def write(
        self, writer: int | None, request: list[Change], trusted: bool, line: int, waited: float
    ) -> None:
        by = requester(writer, line, trusted=trusted, waited=waited)
        self.both(lambda _cell: self.ask_to_write(by, request), lambda m: m.write(by, request, self.now))
        assert not self.ended_leases()

    def ask_to_write(self, by: Requester, request: list[Change]) -> Refusal | None:
        """As links do: the prepared way first, where the request can be prepared."""
        variables = tuple(change.variable for change in request)
        kinds = [(bool, int, float)[VARIABLES[index].kind] for index in variables]
        if (
            len(set(variables)) == len(variables)
            and not OUTPUTS_SET.intersection(variables)
            and all(type(change.value) is kind for change, kind in zip(request, kinds, strict=True))
        ):
            prepared = self.prepared.setdefault(variables, PreparedWrite(self.cell, variables))
            if prepared.write(by, [change.value for change in request], self.now):
                return None
        return self.cell.write(by, request, self.now)

    @rule(data=st.data(), index=st.sampled_from(INPUTS), value=st.sampled_from([0, 1]), implied=st.booleans())
    def write_what_fits(self, data: st.DataObject, index: int, value: int, implied: bool) -> None:
        """Owners on one variable, so that they meet."""
        kind = (bool, int, float)[VARIABLES[index].kind]
        self.write(
            data.draw(st.sampled_from(LOCKS[LOCK_OF[index]].owners)),
            [Change(index, kind(value), implied)],
            data.draw(mostly),
            data.draw(lines),
            data.draw(waits),
        )

    @rule(
        writer=st.integers(0, 2), number=st.sampled_from([0, 5]), real=st.sampled_from([0.0, 2.5]), line=lines
    )
    def write_the_whole_group(self, writer: int, number: int, real: float, line: int) -> None:
        self.write(writer, [Change(4, number), Change(5, real)], True, line, 0.0)

    @rule(
        who=st.tuples(anybody, lines, mostly, waits),
        index=st.integers(0, len(VARIABLES) - 1),
        take=st.booleans(),
        by_word=st.booleans(),
    )
    def ask(self, who: tuple[int | None, int, bool, float], index: int, take: bool, by_word: bool) -> None:
        """Directly, or through the words of the status block."""
        writer, line, trusted, waited = who
        by = requester(writer, line, trusted=trusted, waited=waited)
        if by_word and writer is not None:
            refusal = self.status.write(by, REQUEST if take else RELEASE, [index + 1], self.now)
        else:
            refusal = (self.cell.request if take else self.cell.release)(by, index, self.now)
        assert refusal == self.model.act(by, index, self.now, take=take)

    @rule(writer=writers, indices=st.lists(st.integers(0, len(VARIABLES) - 1), max_size=4))
    def drop_waited(self, writer: int, indices: list[int]) -> None:
        self.cell.drop_waited(Requester(writer), indices, self.now)
        self.model.drop(writer, indices, self.now)

    @rule(writer=writers)
    def release_all(self, writer: int) -> None:
        assert self.status.write(Requester(writer), RELEASE, [RELEASE_ALL], self.now) is None
        for lock in range(len(LOCKS)):
            if self.model.owner[lock] == writer:
                self.model.free(lock, self.now)
        assert writer not in self.cell.ownership.owners

    @rule(writer=anybody, index=st.integers(0, len(VARIABLES) - 1))
    def link_refuses(self, writer: int | None, index: int) -> None:
        refusal = Refusal(Reason.PARTIAL_VALUE, index)
        self.cell.refuse(Requester(writer), refusal, self.now, 1)
        self.model.refuse(writer, refusal, self.now)

    @rule(writer=writers, line=lines)
    def connect(self, writer: int, line: int) -> None:
        by = requester(writer, line)
        self.cell.writer_connected(by, self.now)
        self.model.connect_writer(by, self.now)

    @rule(writer=writers, waited=waits)
    def seen(self, writer: int, waited: float) -> None:
        by = Requester(writer, waited=waited)
        self.cell.writer_seen(by, self.now)
        self.model.hear(by, self.now)

    @rule(writer=writers, line=lines, at_once=st.booleans())
    def disconnect(self, writer: int, line: int, at_once: bool) -> None:
        by = requester(writer, line)
        self.cell.writer_disconnected(by, self.now, "closed", at_once=at_once)
        self.model.disconnect_writer(by, self.now, at_once=at_once)
        if at_once and not self.model.connections[writer]:
            assert writer not in self.cell.ownership.owners

    # The robot.

    @precondition(lambda self: self.now % 0.5 == 0)
    @rule()
    def robot_connects(self) -> None:
        self.cell.robot_connected(self.now)
        self.model.connect(self.now)

    @precondition(lambda self: self.now % 0.5 == 0)
    @rule()
    def robot_is_lost(self) -> None:
        self.cell.robot_lost("gone", self.now)
        self.model.disconnect(self.now)

    @rule(held=adoptions())
    def robot_adopts(self, held: dict[int, Value]) -> None:
        self.cell.adopt(held, self.now)
        self.model.adopt(held, self.now)

    @rule(index=st.sampled_from(INPUTS))
    def fallback_arrives(self, index: int) -> None:
        """Before it does, the end of the session makes it due again."""
        self.cell.delivery.delivered(index)
        self.model.under_way.discard(index)

    @precondition(lambda self: self.model.connected)
    @rule(frozen=st.booleans(), number=st.integers(1, 9), flag=st.booleans())
    def package(self, frozen: bool, number: int, flag: bool) -> None:
        self.timestamp += 0 if frozen else 1
        news = self.cell.package_arrived(self.timestamp, self.now, raw=self.timestamp)
        assert news == self.model.package(self.timestamp, self.now)
        if news:
            values: dict[int, Value] = {8: number, 9: number / 4, 10: -number, 11: flag}
            values = {index: value for index, value in values.items() if index not in self.model.gone}
            for index, value in values.items():
                self.cell.image.values[index] = value
            self.cell.outputs_written(self.now)
            self.model.show(values, self.now)

    @precondition(lambda self: not self.model.connected)
    @rule()
    def robot_comes_up(self) -> None:
        self.robot_connects()
        self.package(frozen=False, number=3, flag=True)
        self.robot_adopts({})

    @precondition(lambda self: not self.model.connected)
    @rule()
    def late_package(self) -> None:
        self.timestamp += 1
        assert not self.cell.package_arrived(self.timestamp, self.now, raw=self.timestamp)
        self.cell.outputs_written(self.now)

    @rule(chosen=st.lists(st.integers(0, len(VARIABLES) - 1), min_size=1, max_size=4), gone=st.booleans())
    def availability(self, chosen: list[int], gone: bool) -> None:
        self.cell.set_availability(chosen, not gone, "as it pleases", self.now)
        for index in chosen:
            self.model.set_gone(index, gone=gone)

    # What must hold whatever happened.

    @invariant()
    def every_value_is_what_somebody_declared_or_wrote(self) -> None:
        image = self.cell.image
        for index in range(len(VARIABLES)):
            assert same(image.values[index], self.model.value[index]), VARIABLES[index].name
            assert image.quality[index] is self.model.quality(index), VARIABLES[index].name
            assert image.time_of(index) == self.model.time_of(index), VARIABLES[index].name

    @invariant()
    def every_lock_has_the_one_owner_it_should(self) -> None:
        table = self.cell.ownership
        for lock, declared in enumerate(LOCKS):
            owner = table.owners[lock]
            assert owner == self.model.owner[lock], declared.name
            assert owner is None or owner in declared.owners
            assert table.expires[lock] == self.model.until[lock], declared.name
            assert owner is None or self.cell.writers.alive[owner]
            assert table.connections[lock] == self.model.worked.get(lock, 0)
        for line in (0, 11, 12, 21, 22, 31, 32, 41, 42):
            assert self.cell.holds(line) is (line != 0 and line in self.model.worked.values())

    @invariant()
    def what_is_due_to_the_robot_is_known(self) -> None:
        assert self.cell.delivery.owed == self.model.due
        assert self.cell.delivery.under_way == self.model.under_way

    @invariant()
    def stale_never_looks_fresh(self) -> None:
        assert self.cell.freshness.state is self.model.source
        assert self.cell.accepts_writes is self.model.adopted
        for index in OUTPUTS:
            good = self.cell.image.quality[index] is Quality.GOOD
            assert not good or self.model.source is Source.FRESH
            assert good or index != 8 or self.cell.image.values[index] == 0
            assert good or index != 10 or self.cell.image.values[index] == -1
        assert (11 in self.cell.unreadable) == (11 not in self.model.good)

    @invariant()
    def every_refusal_is_counted_and_shown(self) -> None:
        assert self.cell.health.writes_accepted == self.model.accepted
        assert self.cell.health.writes_refused == self.model.refused
        last = self.cell.last_refusal
        assert (None if last is None else (last.refusal, last.writer, last.time)) == self.model.last

    @invariant()
    def writers_are_alive_as_heard(self) -> None:
        assert {number for number, alive in enumerate(self.cell.writers.alive) if alive} == self.model.alive

    @invariant()
    def only_the_tick_counts_the_heartbeat(self) -> None:
        assert self.cell.health.heartbeat == self.ticked

    @invariant()
    def everything_that_happened_is_an_event(self) -> None:
        if self.cell.events.count == len(self.cell.events):
            counted = Counter(event.kind for event in self.cell.events)
            del counted[EventKind.REFUSED]
            assert counted == +self.model.events

    @invariant()
    def the_status_block_says_the_same(self) -> None:
        words = struct.unpack(f">{LENGTH}H", self.status.read(0, LENGTH, self.now))
        model = self.model
        assert words[2:4] == (0xDEAD, 0xBEEF)
        good = {index for index in range(len(VARIABLES)) if index in model.good}
        owned = any(owner is not None for owner in model.owner.values())
        assert words[1] == sum(
            flag << bit
            for bit, flag in enumerate(
                [model.source is Source.FRESH, model.adopted, len(good) == 12, owned, model.refused > 0]
            )
        )
        assert words[4] == self.ticked
        assert words[7] == model.source
        assert words[13:16] == (model.sessions, 0, model.packages)
        assert words[20:24] == (0, model.accepted, 0, model.refused)
        if model.last is not None:
            refusal, writer, time = model.last
            numbers = (refusal.variable, writer, refusal.holder)
            assert words[30] == refusal.reason
            assert words[31:34] == tuple(0 if number is None else number + 1 for number in numbers)
            assert words[35] == int((self.now - time) * 1000) & 0xFFFF
        assert words[64] == sum(1 << index for index in good)
        assert words[128:132] == tuple(int(number in model.alive) for number in range(4))
        for index in range(len(VARIABLES)):
            owner = model.owner[LOCK_OF[index]] if index in LOCK_OF else None
            assert words[192 + index] == (0 if owner is None else owner + 1)
            left = 0.0 if owner is None else max(0.0, model.until[LOCK_OF[index]] - self.now)
            assert words[1216 + index] == min(left * 1000, 0xFFFF) // 1
            assert words[2240 + index] == min((self.now - model.time_of(index)) * 1000, 0xFFFF) // 1
            assert words[3264 + index] == model.quality(index)

    def ended_leases(self) -> list[str]:
        table = self.cell.ownership
        return [LOCKS[lock].name for lock, until in enumerate(table.expires) if until <= self.now]

    def teardown(self) -> None:
        """Every refusal is told in the end, one by one or as a count; and all that is owned can be released."""
        if not hasattr(self, "cell") or self.cell.events.count > len(self.cell.events):
            return
        for _ in range(2):
            self.now += 10.0
            self.tick()
        told = sum(1 + event.repeats for event in self.cell.events if event.kind is EventKind.REFUSED)
        assert told == self.model.refused
        for writer in range(4):
            self.release_all(writer)
        assert self.cell.ownership.owners == [None] * len(LOCKS)


TestAnyInterleaving = CellMachine.TestCase
TestAnyInterleaving.settings = settings(max_examples=200, stateful_step_count=50, deadline=None)
