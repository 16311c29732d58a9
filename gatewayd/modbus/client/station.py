"""One unit: what is read from it and when, what is written to it, whether it is there, what is counted. Pure.

Times are seconds of any one clock that never goes back. A `Line` takes the jobs of its stations in turn.

A unit is online from its first answer on, be it an exception, until its breaker opens: after so many failures in a row,
or when nothing came for `lost_after` seconds though something was wanted, whatever the reason.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass
from functools import partial

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.breaker import Breaker, BreakerState
from gatewayd.modbus.client.counters import UnitCounters
from gatewayd.modbus.client.grouping import GroupMember, PollClass, ReadGroup
from gatewayd.modbus.client.identity import IdentityReader, UnitIdentity
from gatewayd.modbus.client.polling import AT_ONCE, NEVER, PollCycle
from gatewayd.modbus.client.requests import (
    BadAnswer,
    ConnectionLost,
    ExceptionAnswer,
    Failure,
    ModbusRequest,
    TimedOut,
    read,
)
from gatewayd.modbus.client.unit import StationListener, StationSettings, UnitState
from gatewayd.modbus.client.writer import UnitWriter
from gatewayd.modbus.client.writes import WriteOrder

MAX_ASKED = 8
"""Requests from outside the polls and writes that may wait for one unit."""

_KEEPALIVE = ReadGroup(Area.HOLDING, 0, 1, (GroupMember(0, 0, 1),), (read(Area.HOLDING, 0, 1),))
"""Any answer shows that a unit is there, an exception too."""


Answered = Callable[["bytes | Failure", float], None]
"""Hears what became of a request, and when."""

_REST = 0.5
"""Time-outs before a place is read again: units that have lost the thread find it in silence."""
_PATIENCE = 1.25
"""How much longer than the one before a late answer may take."""
_DOUBTFUL = 5
"""Time-outs after which an answer is not expected any more, but not before _MIN_DOUBTFUL."""
_MIN_DOUBTFUL = 2.0
"""Seconds."""
_MAX_UNANSWERED = 16


@dataclass(eq=False, slots=True)
class Job:
    """A request on its way, and who hears what became of it."""

    unit: int
    request: ModbusRequest
    timeout: float
    sent_at: float
    done: Callable[[Job, bytes | Failure, float], None]
    """Called once, with the data or the failure, and the time."""
    station: Station | None = None
    """Whose it is; None for a broadcast."""
    is_probe: bool = False
    is_blamed: bool = True
    """Whether the end of the connection counts against the unit: it does where its request was the first underway."""
    read: tuple[PollCycle, ReadGroup, int] | None = None
    """Where the data belong, for a poll."""


class Station:
    """A unit at work."""

    def __init__(self, settings: StationSettings, listener: StationListener) -> None:
        self.settings = settings
        self.listener = listener
        self.state = UnitState.CONNECTING
        self.reason = ""
        """Why it is lost; empty while it is not."""
        self.counters = UnitCounters()
        self.breaker = Breaker(settings.breaker)
        self.identity: UnitIdentity | None = None
        """The last one; None before the first, and where nobody asks."""
        self.deadline = NEVER
        """When it counts as lost unless it answers before."""
        self.write_due = NEVER
        """From when it has something to write."""
        self.read_due = AT_ONCE
        """From when it has something to read, or is to be probed."""
        self.served = 0
        """The line's turn in which it was served last."""
        self.in_flight = 0
        """Its requests underway."""
        self.wake: Callable[[], None] = _nothing
        """Called when there is something to write; set by who runs the line."""
        self._is_polled = bool(settings.polls)
        polls = settings.polls or (PollClass(settings.keepalive, (_KEEPALIVE,)),)
        self._cycles = [PollCycle(poll) for poll in polls]
        self._writer = UnitWriter(has_mask_write=settings.has_mask_write)
        self._reader = IdentityReader(settings.is_identified, settings.serial)
        self._is_identifying = False
        self._asked: deque[tuple[ModbusRequest, Answered]] = deque()
        self._is_renewed = False
        self._hold_until = self._settled_at = AT_ONCE
        self._shared_shapes = _shared_shapes(polls)
        self._repeat: tuple[PollCycle, ReadGroup, int] | None = None
        """What is read next, because an answer to it may still come that nothing tells from another's."""
        self._unanswered: deque[float] = deque(maxlen=_MAX_UNANSWERED)
        """When the requests were sent whose answers may still come."""

    def write(self, key: Hashable, order: WriteOrder, now: float, *, repeat: float | None = None) -> bool:
        """Write as soon as the line is free; the newest wins for each key (`writes`).

        With `repeat` it is written again every so many seconds until another write, or `cancel`, has the key. Returns
        False, and forgets it, while the unit is not online: the caller decides on `state_changed` what to write then.
        """
        if self.state is not UnitState.ONLINE:
            self.counters.dropped_writes += 1
            return False
        if self._writer.put(key, order, repeat, now):
            self.counters.dropped_writes += 1
        self._refresh()
        self.wake()
        return True

    def cancel(self, key: Hashable) -> None:
        """Neither write nor repeat what has this key any more."""
        self._writer.cancel(key)
        self._refresh()

    def ask(self, request: ModbusRequest, answered: Answered) -> bool:
        """Send one more request, once, in the turn of the unit's reads; `answered` hears the outcome, or its loss.

        False while the unit is not online, and where `MAX_ASKED` wait already.
        """
        if self.state is not UnitState.ONLINE or len(self._asked) >= MAX_ASKED:
            return False
        self._asked.append((request, answered))
        self._refresh()
        self.wake()
        return True

    def take_write(self, now: float) -> Job:
        """The next request of a write, to be sent now. Only when `write_due` has come."""
        return self._job(self._writer.take(now), self._write_done, now)

    def take_read(self, now: float) -> Job:
        """The next request that reads, to be sent now. Only when `read_due` has come."""
        is_probe = not self.breaker.is_closed
        if is_probe:
            self.breaker.probe()
        elif self._repeat is None and (request := self._reader.request) is not None:
            self._is_identifying = True
            return self._job(request, self._identity_done, now)
        elif self._repeat is None and self._asked:
            asked, answered = self._asked.popleft()
            return self._job(asked, partial(self._ask_done, answered), now)
        if self._repeat is not None:
            cycle, group, part = self._repeat
            request = cycle.repeat(group, part)
        else:
            cycle = min(self._cycles, key=_due) if len(self._cycles) > 1 else self._cycles[0]
            group, part, request = cycle.take(now)
        job = self._job(request, self._read_done, now)
        job.read, job.is_probe = (cycle, group, part), is_probe
        return job

    def connected(self, now: float, *, may_be_back: bool) -> None:
        """The line's connection is there (again): what is behind it may be another device, or one that was away."""
        self._reader.begin()
        self._repeat = None
        self._is_renewed = self.state is UnitState.ONLINE
        if may_be_back and self.breaker.state is BreakerState.OPEN:
            self.breaker.probe_at = min(self.breaker.probe_at, now)
        self._refresh()

    def unanswered(self, job: Job, now: float) -> None:
        """Its request was not answered on a line where only unit, function and length say what an answer is to.

        An answer that comes later must not be taken for that of another place in the unit: the same place is read
        again, whose answer it may be (`_settle`). After a write or a single request it is left alone for a while.
        """
        self._hold_until = now + (job.timeout if job.read is None else _REST * job.timeout)
        if job.read is not None:
            self._repeat = job.read
            self._unanswered.append(job.sent_at)
        self._refresh()

    def _in_doubt_since(self, now: float) -> float:
        """When the request was sent that an answer may be to which comes now; NEVER: to the last one."""
        earliest = now - max(_DOUBTFUL * self.settings.timeout, _MIN_DOUBTFUL)
        return next((sent_at for sent_at in self._unanswered if sent_at >= earliest), NEVER)

    def _settle(self, job: Job, now: float) -> None:
        """A place is answered that was read more than once. If the first time was meant, the rest comes as late.

        A unit that was lost is probed once more then, before anything that it says counts.
        """
        since = self._in_doubt_since(now)
        if since < NEVER:
            self._settled_at = job.sent_at + _PATIENCE * (now - since)
            if _shape(job.request) in self._shared_shapes:
                self._hold_until = self._settled_at
        self._repeat = None
        self._unanswered.clear()

    def check(self, now: float, trouble: str) -> None:
        """Count it as lost if its deadline has passed, or if it was not there yet and the line has `trouble`."""
        if now >= self.deadline:
            self.breaker.give_up(now)
            self._lose(trouble or f"no answer for {self.settings.breaker.lost_after:g} s", now)
        elif trouble and self.state is not UnitState.ONLINE:
            self._lose(trouble, now)

    def gap(self, length: float) -> None:
        """See `Line.gap`."""
        self.deadline += length
        self._unanswered = deque((sent_at + length for sent_at in self._unanswered), _MAX_UNANSWERED)

    def close(self, reason: str, now: float) -> None:
        """It leaves the line."""
        self.breaker.give_up(now)
        self._lose(reason, now)

    def _refresh(self) -> None:
        """Work out when it has something to say: the line looks at that far more often than it changes."""
        hold = self._hold_until
        if not self.breaker.is_closed:
            is_free = self.breaker.state is BreakerState.OPEN and not self.in_flight
            self.write_due = NEVER
            self.read_due = max(self.breaker.probe_at, hold) if is_free else NEVER
            return
        self.write_due = max(self._writer.due, hold)
        if self.in_flight >= self.settings.in_flight:
            self.read_due = NEVER
        elif self._reader.request is not None and self._repeat is None:
            self.read_due = NEVER if self._is_identifying else max(hold, self._settled_at)
        elif self._repeat is not None:
            self.read_due = hold
        elif self._asked:
            self.read_due = max(hold, self._settled_at)
        elif len(self._cycles) == 1:
            self.read_due = max(self._cycles[0].due, hold)
        else:
            self.read_due = max(min([cycle.due for cycle in self._cycles]), hold)

    def _job(
        self, request: ModbusRequest, done: Callable[[Job, bytes | Failure, float], None], now: float
    ) -> Job:
        self.in_flight += 1
        self.counters.requests += 1
        self._refresh()
        return Job(self.settings.unit, request, self.settings.timeout, now, done, self)

    def _read_done(self, job: Job, outcome: bytes | Failure, now: float) -> None:
        assert job.read is not None
        cycle, group, part = job.read
        if self._repeat is not None and isinstance(outcome, (bytes, ExceptionAnswer)):
            if job.is_probe and self._in_doubt_since(now) < NEVER:
                outcome = BadAnswer("an answer that may be to an earlier request")
            self._settle(job, now)
        if not isinstance(outcome, bytes):
            is_first = cycle.failed(group)
            self._judge(job, outcome, now)
            if is_first and self._is_polled:
                self.listener.read_failed(group, outcome, now)
            return
        data = cycle.answered(group, part, outcome)
        self._judge(job, outcome, now)
        # Values of a unit that was just found wait until it is known which device it is.
        if data is not None and self._is_polled and not (job.is_probe and self._reader.request is not None):
            self.listener.values_read(group, data, now)

    def _write_done(self, job: Job, outcome: bytes | Failure, now: float) -> None:
        if isinstance(outcome, ConnectionLost) and not job.is_blamed:
            self._writer.put_back()
            result = None
        else:
            result = self._writer.done(outcome, now)
        self._judge(job, outcome, now)
        if result is not None:
            if result.failure is None:
                self.counters.writes += 1
            else:
                self.counters.dropped_writes += 1
            self.listener.write_done(result.key, result.failure, now)

    def _identity_done(self, job: Job, outcome: bytes | Failure, now: float) -> None:
        self._is_identifying = False
        identity = None
        # A request that was lost is asked again with the next connection, which begins from the start.
        if self._reader.request is job.request and not isinstance(outcome, ConnectionLost):
            identity = self._reader.answered(outcome if isinstance(outcome, bytes) else None)
        self._judge(job, outcome, now)
        if identity is not None:
            former, self.identity = self.identity, identity
            self.listener.identified(identity, former, now)

    def _ask_done(self, answered: Answered, job: Job, outcome: bytes | Failure, now: float) -> None:
        self._judge(job, outcome, now)
        answered(outcome, now)

    def _judge(self, job: Job, outcome: bytes | Failure, now: float) -> None:
        """Count the outcome of a request, and have the breaker hear of it."""
        self.in_flight -= 1
        counters = self.counters
        if isinstance(outcome, bytes):
            counters.answers += 1
        elif isinstance(outcome, ExceptionAnswer):
            counters.exceptions[outcome.code] += 1
        elif isinstance(outcome, TimedOut):
            counters.time_outs += 1
        elif isinstance(outcome, BadAnswer):
            counters.bad_answers += 1
        else:
            counters.lost_requests += 1
        if isinstance(outcome, (bytes, ExceptionAnswer)):
            counters.round_trip.add(now - job.sent_at)
        if isinstance(outcome, bytes) or (isinstance(outcome, ExceptionAnswer) and not outcome.is_no_answer):
            self._answered(now)
        else:
            self._failed(job, outcome, now)
        self._refresh()

    def _answered(self, now: float) -> None:
        self.breaker.answered()
        wanted = min([cycle.next_due for cycle in self._cycles])
        self.deadline = max(now, wanted, self._hold_until) + self.settings.breaker.lost_after
        if self.state is not UnitState.ONLINE:
            self._reader.begin()
            for cycle in self._cycles:
                cycle.restart(now)
            self.state, self.reason = UnitState.ONLINE, ""
            self._is_renewed = False
            self._refresh()
            self.listener.state_changed(self.state, "", now)
        elif self._is_renewed:
            self._is_renewed = False
            self.listener.connection_renewed(now)

    def _failed(self, job: Job, failure: Failure, now: float) -> None:
        if isinstance(failure, ConnectionLost) and not job.is_blamed:
            if job.is_probe:
                self.breaker.probe_lost(now)
            return
        self.breaker.failed(now)
        if not self.breaker.is_closed:
            self._lose(failure.text, now)

    def _lose(self, reason: str, now: float) -> None:
        self.deadline = NEVER
        self.reason = reason
        if self.state is UnitState.LOST:
            self._refresh()
            return
        self.counters.losses += self.state is UnitState.ONLINE
        self.counters.dropped_writes += self._writer.clear()
        self._refresh()
        self.state = UnitState.LOST
        self.listener.state_changed(self.state, reason, now)
        while self._asked:
            self._asked.popleft()[1](ConnectionLost(reason), now)


def _shape(request: ModbusRequest) -> tuple[int, int]:
    """What tells an answer from those to other requests of a unit on a serial line."""
    return request.function, request.answer_size


def _shared_shapes(polls: Iterable[PollClass]) -> frozenset[tuple[int, int]]:
    """Those of more than one place."""
    places = {
        request.pdu: _shape(request) for poll in polls for group in poll.groups for request in group.requests
    }
    counts = Counter(places.values())
    return frozenset(shape for shape, count in counts.items() if count > 1)


def _due(cycle: PollCycle) -> float:
    return cycle.due


def _nothing() -> None:
    """Nobody runs the line yet."""
