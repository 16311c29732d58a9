"""The requests that are underway on one connection. Pure; seconds of any one clock.

On TCP the transaction id says which request an answer belongs to: one that comes after its time-out is dropped and
counted. On a serial line only unit, function and length say so: what was not answered is asked again before anything
else, and once it is answered there is silence, in which late answers may come and are thrown away (`Station`).
"""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple, Protocol

from gatewayd.modbus.client.framing import RTU_OVERHEAD, AnswerFrame, RtuFraming, TcpFraming
from gatewayd.modbus.client.polling import NEVER
from gatewayd.modbus.client.requests import BadAnswer, Failure, TimedOut, parse_answer
from gatewayd.modbus.client.station import Job
from gatewayd.modbus.client.timing import RtuTiming
from gatewayd.modbus.frames import FramingError

MAX_LATE = 256
"""Requests that were given up and whose late answers are still known for what they are."""
MAX_UNASKED = 1000
"""Frames in a row that no request underway has asked for, after which the connection is given up: a device that floods
it must not keep the loop busy."""
_BROADCAST = 0


class Finished(NamedTuple):
    """A request and what became of it."""

    job: Job
    outcome: bytes | Failure


class Conversation(Protocol):
    """One connection's worth. Made anew for each connection."""

    jobs: list[Job]
    """Underway, in the order in which they were sent."""
    is_ambiguous: bool
    """Whether a late answer could be taken for that of another request to the same unit."""

    def ready_at(self) -> float:
        """From when another request may be sent; NEVER while as many as allowed are underway."""

    def begin(self, job: Job, now: float) -> bytes:
        """The frame of the request, to be sent now."""

    def deadline(self) -> float:
        """When the first request underway times out; NEVER while there is none."""

    def received(self, data: bytes, now: float) -> list[Finished]:
        """What is finished by it. Raises `Broken` where the connection is of no use any more."""

    def expired(self, now: float) -> list[Finished]:
        """What has timed out. Raises `Broken` as well."""


class Broken(Exception):
    """The connection must be closed: what comes in cannot be told apart any more."""

    def __init__(self, reason: str, finished: list[Finished], culprit: Job | None) -> None:
        super().__init__(reason)
        self.finished = finished
        """What was finished before."""
        self.culprit = culprit
        """Underway still, and most likely what broke it; None: it is among those that are finished."""


class TcpConversation:
    """Modbus TCP, up to `most` requests underway (Messaging Guide V1.0b, 4.2.1: up to 16 are usual)."""

    __slots__ = ("_framing", "_late", "_most", "_unasked", "_underway", "is_ambiguous", "jobs")

    def __init__(self, most: int = 1, transaction: int = 0) -> None:
        self._most = most
        self._framing = TcpFraming(transaction)
        self._underway: dict[int, Job] = {}
        self._late: OrderedDict[int, Job] = OrderedDict()
        self._unasked = 0
        self.is_ambiguous = False
        self.jobs: list[Job] = []

    def ready_at(self) -> float:
        """See Conversation."""
        return float("-inf") if len(self.jobs) < self._most else NEVER

    def begin(self, job: Job, now: float) -> bytes:
        """See Conversation."""
        job.sent_at = now
        transaction, frame = self._framing.request(job.unit, job.request.pdu)
        while transaction in self._underway:  # after 65,536 others: not while anything times out
            transaction, frame = self._framing.request(job.unit, job.request.pdu)
        self._late.pop(transaction, None)
        self._underway[transaction] = job
        self.jobs.append(job)
        return frame

    def deadline(self) -> float:
        """See Conversation."""
        return min([job.sent_at + job.timeout for job in self.jobs], default=NEVER)

    def received(self, data: bytes, now: float) -> list[Finished]:
        """See Conversation."""
        finished: list[Finished] = []
        try:
            for frame in self._framing.feed(data):
                job = self._underway.pop(frame.transaction, None)
                self._unasked = 0 if job is not None else self._unasked + 1
                if job is None:
                    self._count_late(frame.transaction)
                    if self._unasked > MAX_UNASKED:
                        raise Broken("answers that nobody has asked for", finished, self._culprit())
                elif frame.unit != job.unit and any(frame.unit == other.unit for other in self.jobs):
                    self._underway[frame.transaction] = job  # more likely it is the transaction that is wrong
                else:
                    self.jobs.remove(job)
                    finished.append(Finished(job, _outcome(job, frame)))
        except FramingError as error:
            culprit = None if _bad(finished) else self._culprit()
            raise Broken(f"bytes that are no Modbus: {error}", finished, culprit) from error
        if self._framing.is_within_frame and _bad(finished):
            raise Broken("a bad answer, and bytes behind it", finished, None)
        return finished

    def expired(self, now: float) -> list[Finished]:
        """See Conversation. A frame that has begun and does not end leaves nothing to tell the next one by."""
        finished = []
        overdue = [(key, job) for key, job in self._underway.items() if job.sent_at + job.timeout <= now]
        if overdue and self._framing.is_within_frame:
            # The answers of the others may have been taken for the rest of it.
            raise Broken("an answer that does not end", [], self._culprit())
        for transaction, job in overdue:
            del self._underway[transaction]
            self.jobs.remove(job)
            self._late[transaction] = job
            if len(self._late) > MAX_LATE:
                self._late.popitem(last=False)
            finished.append(Finished(job, TimedOut(job.timeout)))
        return finished

    def _culprit(self) -> Job | None:
        """Whose answer it most likely is that cannot be told apart; the oldest request where nothing says so."""
        front = self._framing.front
        if front is not None:
            transaction, unit = front
            if transaction in self._underway:
                return self._underway[transaction]
            for job in self.jobs:
                if job.unit == unit:
                    return job
        return self.jobs[0] if self.jobs else None

    def _count_late(self, transaction: int) -> None:
        late = self._late.pop(transaction, None)
        if late is not None and late.station is not None:
            late.station.counters.late_answers += 1


def _outcome(job: Job, frame: AnswerFrame) -> bytes | Failure:
    if frame.unit != job.unit:
        return BadAnswer(f"an answer of unit {frame.unit} instead of {job.unit}")
    return parse_answer(job.request, frame.pdu)


def _bad(finished: list[Finished]) -> bool:
    return any(isinstance(outcome, BadAnswer) for _, outcome in finished)


class RtuConversation:
    """RTU: one request at a time, and the silences between frames."""

    __slots__ = ("_framing", "_quiet_from", "_timing", "is_ambiguous", "jobs")

    def __init__(self, timing: RtuTiming) -> None:
        self._timing = timing
        self._framing = RtuFraming()
        self._quiet_from = float("-inf")
        self.is_ambiguous = True
        self.jobs: list[Job] = []

    @property
    def noise(self) -> int:
        """Bytes that belonged to no answer, so far."""
        return self._framing.noise

    def ready_at(self) -> float:
        """See Conversation."""
        return NEVER if self.jobs else self._quiet_from

    def begin(self, job: Job, now: float) -> bytes:
        """See Conversation."""
        job.sent_at = now
        self.jobs.append(job)
        return self._framing.request(job.unit, job.request)

    def deadline(self) -> float:
        """See Conversation. What the line itself takes is added to the time-out."""
        if not self.jobs:
            return NEVER
        job = self.jobs[0]
        sent = job.sent_at + self._timing.transmission(len(job.request.pdu) + RTU_OVERHEAD)
        if job.unit == _BROADCAST:
            return sent + self._timing.turnaround
        return sent + job.timeout + self._timing.transmission(job.request.answer_size + RTU_OVERHEAD)

    def received(self, data: bytes, now: float) -> list[Finished]:
        """See Conversation."""
        self._quiet_from = now + self._timing.gap
        try:
            frame = self._framing.feed(data)
        except FramingError as error:
            self._framing.reset()
            return [Finished(self.jobs.pop(), BadAnswer(str(error)))]
        if frame is None:
            return []
        job = self.jobs.pop()
        return [Finished(job, parse_answer(job.request, frame.pdu))]

    def expired(self, now: float) -> list[Finished]:
        """See Conversation. A broadcast has no answer: it is done."""
        if not self.jobs or now < self.deadline():
            return []
        job = self.jobs.pop()
        had_part = self._framing.is_within_frame
        self._framing.reset()
        if job.unit == _BROADCAST:
            return [Finished(job, b"")]
        self._quiet_from = max(self._quiet_from, now + self._timing.gap)
        if had_part:
            return [Finished(job, BadAnswer(f"no whole answer within {job.timeout:g} s"))]
        return [Finished(job, TimedOut(job.timeout))]
