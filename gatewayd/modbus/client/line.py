"""Units that share a connection, and whose turn it is. Pure; seconds of any one clock.

Each turn goes to the station with something due that has waited longest for one, so that a unit with much to say takes
no more turns than one with little. Writes go before reads, but not more than MAX_WRITES_IN_ROW while a read waits.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum

from gatewayd.modbus.client.breaker import BreakerState
from gatewayd.modbus.client.conversation import Broken, Conversation, Finished
from gatewayd.modbus.client.polling import AT_ONCE, NEVER
from gatewayd.modbus.client.probes import DEFAULT_SHARE, ProbeBudget
from gatewayd.modbus.client.requests import (
    ConnectionLost,
    ExceptionAnswer,
    Failure,
    ModbusRequest,
)
from gatewayd.modbus.client.station import Job, Station

MAX_WRITES_IN_ROW = 2
MAX_BROADCASTS = 16


class ConnectionUse(Enum):
    """How long a connection is kept."""

    KEPT = "kept"
    PER_REQUEST = "per request"
    """For devices that answer the first request of a connection only."""


@dataclass(frozen=True, slots=True)
class LineSettings:
    """What the units of a line share."""

    in_flight: int = 1
    """Requests at the same time, at most; more than 1 on Modbus TCP only."""
    use: ConnectionUse = ConnectionUse.KEPT
    pause: float = 0.0
    """Seconds between an answer and the next request, for devices that need them."""
    probe_share: float = DEFAULT_SHARE
    """Share of the time that probes of lost units may cost those that answer."""
    connect_timeout: float = 3.0
    """Seconds to open a connection."""
    max_backoff: float = 5.0
    """Greatest pause between two attempts to open it, in seconds."""


class Line:
    """What is sent next on one connection, and to whom an answer goes."""

    def __init__(self, settings: LineSettings, stations: Iterable[Station] = ()) -> None:
        self.settings = settings
        self.stations: list[Station] = []
        self.trouble = ""
        """Why there is no connection, in words; empty while there is one."""
        self.connections = 0
        """That were opened, so far."""
        self.was_of_use = False
        """Whether anything was answered on the connection, or on the last one."""
        self.silence_limit = NEVER
        """Seconds after which a connection is given up on which nobody at all answers."""
        self._conversation: Conversation | None = None
        self._unanswered_since = NEVER
        self._budget = ProbeBudget(settings.probe_share)
        self._turns = 0
        self._writes_in_row = 0
        self._paused_until = float("-inf")
        self._may_be_back: set[Station] = set()
        self._probe: Job | None = None
        self._failed_probe_at = 0
        self._broadcasts: deque[ModbusRequest] = deque()
        self._has_finished = False
        self._culprit: Job | None = None
        self._is_culprit_known = False
        self._is_nobodys_fault = True
        for station in stations:
            self.add(station)

    @property
    def is_connected(self) -> bool:
        """Whether there is a connection."""
        return self._conversation is not None

    def add(self, station: Station) -> None:
        """Another unit, which may be added at any time."""
        self.stations.append(station)
        station.served = 0
        self._may_be_back.add(station)

    def remove(self, station: Station, now: float) -> None:
        """The unit goes: it counts as lost, and what is underway for it is ignored."""
        self.stations.remove(station)
        self._may_be_back.discard(station)
        if self._conversation is not None:
            for job in self._conversation.jobs:
                if job.station is station:
                    job.done, job.station = _ignored, None
                    if job is self._probe:
                        self._probe = None
        station.close("it is not asked any more", now)

    def broadcast(self, request: ModbusRequest) -> bool:
        """Send a write to all units of a serial line (unit 0); nothing is answered. False: too many wait already."""
        if len(self._broadcasts) >= MAX_BROADCASTS:
            return False
        self._broadcasts.append(request)
        return True

    @property
    def is_spent(self) -> bool:
        """Whether the connection has served the one request that it was opened for."""
        return (
            self._has_finished
            and self._conversation is not None
            and not self._conversation.jobs
            and self.settings.use is ConnectionUse.PER_REQUEST
        )

    def connected(self, conversation: Conversation, now: float) -> None:
        """The connection is open."""
        is_new = self.settings.use is ConnectionUse.KEPT or bool(self.trouble) or not self.connections
        self._conversation = conversation
        self._has_finished = self._is_culprit_known = self.was_of_use = False
        self._unanswered_since = NEVER
        self.trouble = ""
        self.connections += 1
        for station in self.stations if is_new else ():
            station.connected(now, may_be_back=self._is_nobodys_fault)
            if self._is_nobodys_fault:
                self._may_be_back.add(station)

    def disconnected(self, reason: str, now: float) -> None:
        """It has ended, or could not be opened: what was underway is lost.

        Who has broken it is blamed, or the first of those underway where that is not known.

        Without a reason it was closed because it is spent, which is no trouble.
        """
        jobs = self._conversation.jobs if self._conversation is not None else []
        # A unit whose answers break the connection must not be probed again as often as that is opened again.
        self._is_nobodys_fault = self._conversation is None or not (jobs or self._is_culprit_known)
        self._conversation = None
        self.trouble = reason
        culprit = self._culprit if self._is_culprit_known else next(iter(jobs), None)
        for job in jobs:
            job.is_blamed = job is culprit
            self._finish(Finished(job, ConnectionLost(reason)), now)
        self.check(now)

    def gap(self, length: float) -> None:
        """The process stood still for so many seconds, in which no answer could be heard: they are no silence."""
        self._unanswered_since += length
        for job in self._conversation.jobs if self._conversation is not None else ():
            job.sent_at += length
        for station in self.stations:
            station.gap(length)

    def stop(self, reason: str, now: float) -> None:
        """Nobody runs it any more: all units are lost."""
        self.disconnected(reason, now)
        for station in self.stations:
            station.close(reason, now)

    def received(self, data: bytes, now: float) -> str:
        """Bytes have come in. Why the connection has to be closed, or nothing."""
        assert self._conversation is not None
        self._unanswered_since = NEVER
        return self._take(self._conversation.received, data, now)

    def check(self, now: float) -> str:
        """Judge what has timed out. Why the connection has to be closed, or nothing."""
        reason = ""
        if self._conversation is not None and self._conversation.deadline() <= now:
            reason = self._take(lambda _, now: self._expired(now), b"", now)
        trouble = self.trouble
        for station in self.stations:
            if trouble or now >= station.deadline:
                if now >= station.deadline:
                    self._may_be_back.add(station)
                station.check(now, trouble)
        if not reason and self._is_silent(now):
            reason = f"nobody answers for {self.silence_limit:g} s"
        return reason

    def next_frame(self, now: float) -> bytes | None:
        """What to send now, if anything."""
        conversation = self._conversation
        if conversation is None or max(conversation.ready_at(), self._paused_until) > now or self.is_spent:
            return None
        job = self._next_job(now)
        return None if job is None else conversation.begin(job, now)

    def wake_at(self) -> float:
        """When `check` and `next_frame` are to be called again if nothing happens before; NEVER where nothing would."""
        deadline = min([station.deadline for station in self.stations], default=NEVER)
        conversation = self._conversation
        if conversation is None:
            return deadline
        deadline = min(deadline, conversation.deadline())
        ready = max(conversation.ready_at(), self._paused_until)
        if ready >= deadline or self.is_spent:
            return deadline
        return min(deadline, max(ready, self.due_at()))

    def due_at(self) -> float:
        """When somebody has something to send, connection or not."""
        if self._broadcasts:
            return float("-inf")
        allowed = self._probes_allowed()
        due = NEVER
        for station in self.stations:
            due = min(due, station.write_due)
            if station.read_due < due:
                due = min(due, self._read_due(station, allowed))
        return due

    def _is_silent(self, now: float) -> bool:
        return (
            self._conversation is not None
            and now - self._unanswered_since >= self.silence_limit
            and not self._is_protected
        )

    @property
    def _is_ambiguous(self) -> bool:
        """Whether a late answer could be taken for that of the unit's next request."""
        return self._conversation is not None and self._conversation.is_ambiguous

    @property
    def _is_protected(self) -> bool:
        """Whether there is somebody whom probes would cost time."""
        for station in self.stations:  # noqa: SIM110 - asked several times for each answer; `any` takes thrice as long
            if station.breaker.state is BreakerState.CLOSED:
                return True
        return False

    def _probes_allowed(self) -> tuple[float, float]:
        """When the next probe may go out, one after the other: to a unit that stays away, to one that may be back."""
        if not self._is_protected:
            return AT_ONCE, AT_ONCE
        return (self._budget.free_at, AT_ONCE) if self._probe is None else (NEVER, NEVER)

    def _read_due(self, station: Station, allowed: tuple[float, float]) -> float:
        if station.breaker.state is BreakerState.CLOSED:
            return station.read_due
        return max(station.read_due, allowed[station in self._may_be_back])

    def _next_job(self, now: float) -> Job | None:
        if self._broadcasts:
            return Job(0, self._broadcasts.popleft(), 0.0, now, _ignored)
        writing, reading = self._waiting(now)
        if writing is not None and (reading is None or self._writes_in_row < MAX_WRITES_IN_ROW):
            self._writes_in_row += 1
            self._serve(writing)
            return writing.take_write(now)
        if reading is None:
            return None
        self._writes_in_row = 0
        self._serve(reading)
        job = reading.take_read(now)
        if job.is_probe:
            self._probe = job
            self._may_be_back.discard(reading)
        return job

    def _waiting(self, now: float) -> tuple[Station | None, Station | None]:
        """Who is next to write, and who to be read or probed."""
        writing = polled = probed = None
        allowed = self._probes_allowed()
        for station in self.stations:
            if station.write_due <= now and (writing is None or station.served < writing.served):
                writing = station
            if station.read_due > now:
                continue
            if station.breaker.state is BreakerState.CLOSED:
                if polled is None or station.served < polled.served:
                    polled = station
            elif (probed is None or station.served < probed.served) and self._read_due(
                station, allowed
            ) <= now:
                probed = station
        return writing, self._first(polled, probed)

    def _first(self, polled: Station | None, probed: Station | None) -> Station | None:
        """Who has waited longer; but between two probes in vain everybody who answers has a turn."""
        if polled is None or probed is None:
            return polled or probed
        return polled if polled.served < max(probed.served, self._failed_probe_at) else probed

    def _serve(self, station: Station) -> None:
        self._turns += 1
        station.served = self._turns

    def _expired(self, now: float) -> list[Finished]:
        assert self._conversation is not None
        return self._conversation.expired(now)

    def _take(self, take: Callable[[bytes, float], list[Finished]], data: bytes, now: float) -> str:
        try:
            finished, reason = take(data, now), ""
        except Broken as error:
            finished, reason = error.finished, str(error)
            self._culprit, self._is_culprit_known = error.culprit, True
        for one in finished:
            self._finish(one, now)
        return reason

    def _finish(self, finished: Finished, now: float) -> None:
        job, outcome = finished
        if job is self._probe:
            self._probe = None
        if self.settings.pause:
            self._paused_until = now + self.settings.pause
        self._has_finished = True
        is_answered = isinstance(outcome, bytes | ExceptionAnswer)
        self.was_of_use = self.was_of_use or is_answered
        if not is_answered:
            self._unanswered_since = min(self._unanswered_since, job.sent_at)
        station = job.station
        if not is_answered and station is not None and self._is_ambiguous:
            station.hold(now + job.timeout)
        was_protected = self._is_protected
        was_closed = station is not None and station.breaker.is_closed
        job.done(job, outcome, now)
        if station is not None and was_closed and not station.breaker.is_closed:
            self._may_be_back.add(station)
        if job.is_probe and station is not None and not station.breaker.is_closed:
            cost = now - job.sent_at
            if not is_answered:
                cost = max(cost, job.timeout)  # bytes that are no answer may cost others theirs
            self._budget.spend(cost, now)
            self._failed_probe_at = self._turns + 1
        if not was_protected and self._is_protected:
            # What was off altogether comes back together: nobody waits for those that stay away.
            self._may_be_back.update(self.stations)


def _ignored(job: Job, outcome: bytes | Failure, now: float) -> None:
    """Nobody hears what becomes of it."""
