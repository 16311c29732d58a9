"""One connection and the units that share it: what is sent next, and to whom an answer goes. Pure.

Seconds of any one clock. `turns` decides who is next.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum

from gatewayd.modbus.client.conversation import Broken, Conversation, Finished
from gatewayd.modbus.client.polling import NEVER
from gatewayd.modbus.client.probes import DEFAULT_SHARE
from gatewayd.modbus.client.requests import (
    ConnectionLost,
    ExceptionAnswer,
    Failure,
    ModbusRequest,
)
from gatewayd.modbus.client.station import Job, Station
from gatewayd.modbus.client.turns import Turns

MAX_BROADCASTS = 16
_SHORT_CONNECTIONS = 3
"""Connections in a row that the device ended after one answer, from which on that is how it is."""


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
        self._turns = Turns(settings.probe_share)
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
        self._paused_until = float("-inf")
        self._broadcasts: deque[ModbusRequest] = deque()
        self._has_finished = False
        self._answers = 0
        self._short_connections = 0
        self._culprit: Job | None = None
        self._is_culprit_known = False
        self._is_nobodys_fault = True
        for station in stations:
            self.add(station)

    @property
    def stations(self) -> list[Station]:
        """The units."""
        return self._turns.stations

    @property
    def closes_after_answer(self) -> bool:
        """Whether the device ends each connection after one answer, so that it is better asked by one for each."""
        return self._short_connections >= _SHORT_CONNECTIONS

    @property
    def is_connected(self) -> bool:
        """Whether there is a connection."""
        return self._conversation is not None

    def add(self, station: Station) -> None:
        """Another unit, which may be added at any time."""
        self._turns.add(station)

    def remove(self, station: Station, now: float) -> None:
        """The unit goes: it counts as lost, and what is underway for it is ignored."""
        self._turns.remove(station)
        if self._conversation is not None:
            for job in self._conversation.jobs:
                if job.station is station:
                    job.done, job.station = _ignored, None
                    self._turns.forget(job)
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
        self._answers = 0
        self._unanswered_since = NEVER
        self.trouble = ""
        self.connections += 1
        for station in self.stations if is_new else ():
            station.connected(now, may_be_back=self._is_nobodys_fault)
            if self._is_nobodys_fault:
                self._turns.may_be_back(station)

    def disconnected(self, reason: str, now: float) -> None:
        """It has ended, or could not be opened: what was underway is lost.

        Who has broken it is blamed, or the first of those underway where that is not known.

        Without a reason it was closed because it is spent, which is no trouble.
        """
        jobs = self._conversation.jobs if self._conversation is not None else []
        # A unit whose answers break the connection must not be probed again as often as that is opened again.
        self._is_nobodys_fault = self._conversation is None or not (jobs or self._is_culprit_known)
        if self._conversation is not None and self.settings.use is ConnectionUse.KEPT:
            self._short_connections = self._short_connections + 1 if self._answers == 1 else 0
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
                    self._turns.may_be_back(station)
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
        return self._turns.due_at()

    def _is_silent(self, now: float) -> bool:
        return (
            self._conversation is not None
            and now - self._unanswered_since >= self.silence_limit
            and not self._turns.is_anybody_there
        )

    @property
    def _is_ambiguous(self) -> bool:
        """Whether a late answer could be taken for that of the unit's next request."""
        return self._conversation is not None and self._conversation.is_ambiguous

    def _next_job(self, now: float) -> Job | None:
        if self._broadcasts:
            return Job(0, self._broadcasts.popleft(), 0.0, now, _ignored)
        return self._turns.next(now)

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
        if self.settings.pause:
            self._paused_until = now + self.settings.pause
        self._has_finished = True
        is_answered = isinstance(outcome, bytes | ExceptionAnswer)
        self.was_of_use = self.was_of_use or is_answered
        self._answers += is_answered
        if self._answers > 1:
            self._short_connections = 0
        if not is_answered:
            self._unanswered_since = min(self._unanswered_since, job.sent_at)
        station = job.station
        if not is_answered and station is not None and self._is_ambiguous:
            station.unanswered(job, now)
        self._turns.finish(job, outcome, now)


def _ignored(job: Job, outcome: bytes | Failure, now: float) -> None:
    """Nobody hears what becomes of it."""
