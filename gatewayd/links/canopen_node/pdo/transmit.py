"""When TPDOs are sent (CiA 301, 7.2.2 and 7.5.2.37): on change, on SYNC, by event timer, after the inhibit time.

What a signal means for a TPDO follows from its schedule by the table `MOVES`:

- event-driven (254, 255): sent at once when the content differs from what was sent last, when the event timer has run
  out, and when the PDO starts; within the inhibit time it waits, and then goes out with the newest content;
- acyclic synchronous (0): sent with the next SYNC under the same condition;
- cyclic synchronous (1-240): sent with the first SYNC and every n-th after it. Where SYNC carries a counter, the one
  that equals the SYNC start value counts as the first.

The content differs if its bytes do, and for a real with a deadband only if it moved by at least that much since it was
sent. Each frame holds one moment of the image, and of the status block where it carries words of it; those are looked
at whenever the cell changes, and every `STATUS_LOOK` seconds. A TPDO with a variable that may not be read now
(`Cell.unreadable`) stops, and starts again with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from operator import attrgetter
from typing import Final

from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value, Variable
from gatewayd.core.status import StatusBlock
from gatewayd.links.canopen_node.pdo.codec import ReadWord
from gatewayd.links.canopen_node.pdo.parameters import Configuration
from gatewayd.links.registry import status_fields

STATUS_LOOK: Final = 0.1
"""Seconds between two looks at status words that change with time, as the heartbeat of the core does."""


class Schedule(Enum):
    """What decides when a TPDO is sent."""

    EVENT = "254, 255"
    ACYCLIC = "0"
    CYCLIC = "1-240"

    @classmethod
    def of(cls, transmission: int) -> Schedule:
        """The schedule of a transmission type."""
        if transmission == 0:
            return cls.ACYCLIC
        return cls.EVENT if transmission > 240 else cls.CYCLIC


class TransmitSignal(Enum):
    """What may make a TPDO be sent."""

    START = "OPERATIONAL was entered, the PDO became valid, or its variables may be read again"
    CHANGE = "the content differs from what was sent last"
    TIMER = "the event timer has run out"
    INHIBIT_OVER = "the inhibit time has passed while something waited for it"
    SYNC = "a SYNC was received"


class TransmitMove(Enum):
    """What is done."""

    SEND = "send, as soon as the inhibit time allows"
    SEND_NEWS = "send what differs, or what waits"
    WAIT = "send with the next SYNC"
    COUNT = "count a SYNC, and send with every n-th"
    REWIND = "begin to count anew"


MOVES: dict[tuple[Schedule, TransmitSignal], TransmitMove] = {
    (Schedule.EVENT, TransmitSignal.START): TransmitMove.SEND,
    (Schedule.EVENT, TransmitSignal.CHANGE): TransmitMove.SEND_NEWS,
    (Schedule.EVENT, TransmitSignal.TIMER): TransmitMove.SEND,
    (Schedule.EVENT, TransmitSignal.INHIBIT_OVER): TransmitMove.SEND_NEWS,
    (Schedule.ACYCLIC, TransmitSignal.START): TransmitMove.WAIT,
    (Schedule.ACYCLIC, TransmitSignal.SYNC): TransmitMove.SEND_NEWS,
    (Schedule.CYCLIC, TransmitSignal.START): TransmitMove.REWIND,
    (Schedule.CYCLIC, TransmitSignal.SYNC): TransmitMove.COUNT,
}
"""A pair that is not listed does nothing."""


_REACHED: Final = 1 - 2**-20
"""A deadband is decimal, and the difference of two values is not: 0.3 - 0.2 has reached 0.1."""


class TransmitPdo:
    """One valid TPDO: its compiled content and what is known of the last transmission."""

    def __init__(self, configuration: Configuration, variables: Sequence[Variable], read: ReadWord) -> None:
        layout = configuration.layout
        schedule = Schedule.of(configuration.transmission)
        deadbands = tuple(
            variables[entry.variable].deadband * _REACHED if entry.variable is not None else 0.0
            for entry in layout.content
        )
        self.configuration = configuration
        self.can_id = configuration.can_id
        self.moves = {signal: move for (when, signal), move in MOVES.items() if when is schedule}
        self.gather = layout.gatherer(read)
        self.has_status = layout.has_status
        self.pack = layout.pack
        self.guarded = frozenset(layout.variables)
        self.deadbands = deadbands if any(deadbands) else None
        self.content: Sequence[Value] | None = None
        """What was sent last, as `gather` returned it."""
        self.data = b""
        """What was sent last, as bytes."""
        self.waits = False
        """Something is to be sent when the inhibit time is over, or with the next SYNC."""
        self.forced = False
        """It is to be sent whether it differs or not."""
        self.earliest = 0.0
        """When the inhibit time ends."""
        self.due = math.inf
        """When the event timer runs out."""
        self.countdown: int | None = None
        """SYNCs until the next cyclic transmission; None: before the first one."""
        self.is_stopped = False
        """A variable of it may not be read now."""

    @property
    def deadline(self) -> float:
        """When time alone makes something happen."""
        return min(self.earliest, self.due) if self.waits else self.due

    def rest(self) -> None:
        """Let nothing wait, and the event timer stand still."""
        self.waits = self.forced = False
        self.due = math.inf

    def count(self) -> bool:
        """Count a SYNC. Returns whether it is one to send with."""
        self.countdown = (self.countdown or 1) - 1
        if self.countdown:
            return False
        self.countdown = self.configuration.transmission
        return True

    def news(self, content: Sequence[Value]) -> bytes | None:
        """The bytes to send; None if nothing differs enough from what was sent last."""
        if not self.forced and self.deadbands is not None and not self._has_moved(content, self.deadbands):
            return None
        data = self.pack(content)
        if data != self.data or self.forced:
            return data
        if self.deadbands is None:
            # Equal on the bus though not in the image (NaN, -0.0, beyond REAL32): compare with this from now on.
            self.content = content
        return None

    def _has_moved(self, content: Sequence[Value], deadbands: Sequence[float]) -> bool:
        return self.content is None or any(
            new != old and not abs(new - old) < deadband and not (math.isnan(new) and math.isnan(old))
            for new, old, deadband in zip(content, self.content, deadbands, strict=True)
        )


class TransmitEngine:
    """All TPDOs of a node.

    `configure` takes the PDOs, `nmt` lets them run. `next_deadline` says when `tick` is wanted; a PDO that was
    configured while they run starts with the next `tick`.
    """

    def __init__(self, cell: Cell, send: Send) -> None:
        self.is_operational = False
        self._cell = cell
        self._values = cell.image.values
        self._block = StatusBlock(cell, status_fields())
        self._now = 0.0
        """The time of the last call, at which words of the status block are read."""
        self._look_due = math.inf
        self._send = send
        self._pdos: dict[int, TransmitPdo] = {}
        self._event_driven: list[TransmitPdo] = []
        self._with_status: list[TransmitPdo] = []
        """Those of them that carry words of the status block."""
        self._synchronous: list[TransmitPdo] = []
        self._fresh: list[TransmitPdo] = []
        self._unreadable = frozenset[int]()
        self._deadline: float | None = math.inf
        self._acts: dict[TransmitMove, Callable[[TransmitPdo, float], None]] = {
            TransmitMove.SEND: self._send_forced,
            TransmitMove.SEND_NEWS: self._send_news,
            TransmitMove.WAIT: self._wait,
            TransmitMove.COUNT: self._count,
            TransmitMove.REWIND: self._rewind,
        }

    @property
    def pdos(self) -> tuple[TransmitPdo, ...]:
        """The valid TPDOs by number."""
        return tuple(self._pdos[number] for number in sorted(self._pdos))

    def configure(self, number: int, configuration: Configuration | None) -> None:
        """A TPDO is now like this; None: it does not exist. The inhibit time that runs for it goes on."""
        former = self._pdos.pop(number, None)
        if configuration is not None:
            pdo = TransmitPdo(configuration, self._cell.definition.variables, self._read_word)
            if former is not None:
                pdo.earliest = 0.0 if configuration.is_synchronous else former.earliest
            self._pdos[number] = pdo
            self._fresh.append(pdo)
        pdos = self.pdos
        self._event_driven = [pdo for pdo in pdos if not pdo.configuration.is_synchronous]
        self._synchronous = [pdo for pdo in pdos if pdo.configuration.is_synchronous]
        self._with_status = [pdo for pdo in self._event_driven if pdo.has_status]
        self._look_due = self._now if self._with_status else math.inf
        self._fresh = [pdo for pdo in self._fresh if pdo in pdos]
        self._deadline = None

    def nmt(self, operational: bool, now: float) -> None:
        """OPERATIONAL was entered or left."""
        self._now = now
        if operational == self.is_operational:
            return
        self.is_operational = operational
        self._deadline = None
        if operational:
            self._fresh = list(self.pdos)
            self._judge(now)
            return
        for pdo in self._pdos.values():
            pdo.rest()
            pdo.earliest = 0.0

    def image_changed(self, now: float) -> None:
        """Output values or qualities have changed."""
        self._compare(self._event_driven, now)

    def status_changed(self, now: float) -> None:
        """Something else of the cell has changed: words of the status block may have."""
        self._compare(self._with_status, now)

    def on_sync(self, counter: int | None, now: float, *, late: bool = False) -> None:
        """A SYNC was received, with this counter if it has one.

        `late`: it waited while the process stood still. It is counted, but what it asked for is over.
        """
        self._now = now
        if not self.is_operational:
            return
        self._look(now)
        for pdo in self._synchronous:
            if pdo.is_stopped or not _counts(pdo, counter):
                continue
            if not late:
                self._happened(pdo, TransmitSignal.SYNC, now)
            elif pdo.moves.get(TransmitSignal.SYNC) is TransmitMove.COUNT:
                pdo.count()

    def tick(self, now: float) -> None:
        """Send what time makes due. Cheap before `next_deadline`."""
        self._now = now
        if not self.is_operational:
            return
        self._look(now)
        if now < self.next_deadline():
            return
        if now >= self._look_due:
            self._look_due = now + STATUS_LOOK
            self._compare(self._with_status, now)
        for pdo in self._event_driven:
            if pdo.waits and now >= pdo.earliest:
                self._happened(pdo, TransmitSignal.INHIBIT_OVER, now)
            if now >= pdo.due:
                self._timer(pdo, now)
        self._deadline = None

    def renew(self, can_id: int, now: float) -> Frame | None:
        """In place of a frame that has waited too long for the bus: what it would hold now; None if it is nothing.

        A synchronous PDO holds the moment of its SYNC, which is over.
        """
        self._now = now
        pdo = next((pdo for pdo in self._pdos.values() if pdo.can_id == can_id), None)
        if pdo is None or not self.is_operational or pdo.is_stopped:
            return None
        if pdo.configuration.is_synchronous:
            pdo.forced = True
            return None
        pdo.content = pdo.gather(self._values)
        pdo.data = pdo.pack(pdo.content)
        return Frame(can_id, pdo.data)

    def next_deadline(self, now: float = 0.0) -> float:
        """When `tick` is wanted, not before `now`; infinity if never. It may turn out then that nothing is due yet."""
        if self._deadline is None:
            self._deadline = self._earliest_deadline()
        return max(self._deadline, now)

    # -- inside --------------------------------------------------------------------------------------------------

    def _earliest_deadline(self) -> float:
        if not self.is_operational:
            return math.inf
        if self._fresh:
            return 0.0
        return min(self._look_due, min(map(_deadline_of, self._event_driven), default=math.inf))

    def _compare(self, pdos: Iterable[TransmitPdo], now: float) -> None:
        self._now = now
        if not self.is_operational:
            return
        self._look(now)
        values = self._values
        for pdo in pdos:
            if pdo.gather(values) != pdo.content and not pdo.waits and not pdo.is_stopped:
                self._happened(pdo, TransmitSignal.CHANGE, now)

    def _read_word(self, offset: int, words: int) -> int:
        return int.from_bytes(self._block.read(offset, words, self._now), "big")

    def _look(self, now: float) -> None:
        """Notice what happened beside the image: PDOs configured anew, variables that may be read or not."""
        if self._fresh or self._cell.unreadable is not self._unreadable:
            self._judge(now)

    def _judge(self, now: float) -> None:
        """Stop what may not be read now; start what may again, and what is new."""
        self._unreadable = self._cell.unreadable
        fresh, self._fresh = set(self._fresh), []
        for pdo in self.pdos:
            was_stopped, pdo.is_stopped = pdo.is_stopped, not self._unreadable.isdisjoint(pdo.guarded)
            if pdo.is_stopped:
                pdo.rest()
            elif was_stopped or pdo in fresh:
                self._happened(pdo, TransmitSignal.START, now)
        self._deadline = None

    def _happened(self, pdo: TransmitPdo, signal: TransmitSignal, now: float) -> None:
        move = pdo.moves.get(signal)
        if move is not None:
            self._acts[move](pdo, now)

    def _timer(self, pdo: TransmitPdo, now: float) -> None:
        period = pdo.configuration.event
        late = now - pdo.due
        pdo.due = math.inf
        self._happened(pdo, TransmitSignal.TIMER, now)
        if not pdo.waits and late < period:
            # Late calls do not add up: the next one is due a period after this one was.
            pdo.due -= late

    def _send_forced(self, pdo: TransmitPdo, now: float) -> None:
        pdo.forced = True
        self._send_news(pdo, now)

    def _send_news(self, pdo: TransmitPdo, now: float) -> None:
        if now < pdo.earliest:
            pdo.waits = True
            self._expect(pdo.earliest)
            return
        pdo.waits = False
        content = pdo.gather(self._values)
        data = pdo.news(content)
        if data is not None:
            self._emit(pdo, content, data, now)

    def _wait(self, pdo: TransmitPdo, _now: float) -> None:
        pdo.forced = True

    def _rewind(self, pdo: TransmitPdo, _now: float) -> None:
        pdo.countdown = None

    def _count(self, pdo: TransmitPdo, now: float) -> None:
        if pdo.count():
            content = pdo.gather(self._values)
            self._emit(pdo, content, pdo.pack(content), now)

    def _emit(self, pdo: TransmitPdo, content: Sequence[Value], data: bytes, now: float) -> None:
        pdo.content = content
        pdo.data = data
        pdo.forced = False
        configuration = pdo.configuration
        if not configuration.is_synchronous:
            pdo.earliest = now + configuration.inhibit
            if configuration.event:
                pdo.due = now + configuration.event
                self._expect(pdo.due)
        self._send(Frame(pdo.can_id, data), Priority.NEWEST)

    def _expect(self, deadline: float) -> None:
        if self._deadline is not None and deadline < self._deadline:
            self._deadline = deadline


_deadline_of: Final = attrgetter("deadline")


def _counts(pdo: TransmitPdo, counter: int | None) -> bool:
    """Whether a SYNC counts for the PDO: before its first one, only the one with the SYNC start value does."""
    if pdo.countdown is not None or not counter:
        return True
    start = pdo.configuration.sync_start
    return start in (0, counter) or pdo.configuration.transmission == 0
