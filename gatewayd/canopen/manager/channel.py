"""The SDO channel to one device: whatever wants to read or write it waits here for its turn.

A device has one default SDO server, so it has one client, and one transfer at a time. What waits is bounded. A write
takes the place of an older one of its object that waits: the device gets the newest value, in the older one's turn.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.describe import abort_text, object_text
from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.canopen.sdo.client import SdoClient, SdoResult

MAX_CODES = 32
"""Abort codes that are counted apart: a device may send whatever it likes."""
CAPACITY = 256
"""Transfers that may wait for one device."""

Done = Callable[[SdoResult, float], None]


@dataclass(slots=True, eq=False)
class SdoJob:
    """One transfer that waits."""

    index: int
    subindex: int
    data: bytes | None
    """What is written; None: it is read."""
    done: Done


@dataclass(slots=True)
class SdoCounters:
    """What became of the transfers with one device."""

    transfers: int = 0
    timeouts: int = 0
    aborts: int = 0
    """Ended by an abort code, of the device or of the client."""
    overflow: int = 0
    """Found no room to wait in."""
    codes: Counter[int] = field(default_factory=Counter)
    """Aborts by code; of more codes than `MAX_CODES` the others count as 08000000h (general error)."""


class SdoChannel:
    """Transfers with the default SDO server of one node, one after the other."""

    def __init__(self, node: int, send: Send, timeout: float) -> None:
        self.counters = SdoCounters()
        self.last_abort = ""
        """The last abort in words: `06020000h no such object, read 2010h:00`."""
        self.round_trip: float | None = None
        """Seconds that the last transfer took that was answered."""
        self._client = SdoClient(timeout)
        self._begun = 0.0
        self._request = Function.SDO_REQUEST + node
        self._send = send
        self._waiting: deque[SdoJob] = deque()
        self._running: SdoJob | None = None

    def __len__(self) -> int:
        return len(self._waiting) + (self._running is not None)

    def put(self, job: SdoJob, now: float) -> bool:
        """Do it when it is its turn, and call its `done` then. False: too much waits already."""
        if job.data is not None:
            older = next((item for item in self._waiting if self._is_replaced(item, job)), None)
            if older is not None:
                older.data, older.done = job.data, job.done
                return True
        if len(self._waiting) >= CAPACITY:
            self.counters.overflow += 1
            return False
        self._waiting.append(job)
        self._advance(now)
        return True

    def receive(self, frame: Frame, now: float) -> None:
        """A frame of the server."""
        if not frame.remote:
            self._give(self._client.receive(frame.data, now))
            self._advance(now)

    def tick(self, now: float) -> None:
        """Notice that the device does not answer."""
        self._give(self._client.tick(now))
        self._advance(now)

    def next_deadline(self) -> float:
        """When `tick` has something to do."""
        return self._client.next_deadline()

    def spare(self, time: float) -> None:
        """The process stood still for so many seconds: no answer could be heard."""
        self._client.spare(time)

    def forget(self) -> None:
        """Drop everything that waits, and end the present transfer; nobody is called for them."""
        self._waiting.clear()
        self._running = None
        self._give(self._client.give_up(AbortCode.GENERAL))
        self._client.take()

    @staticmethod
    def _is_replaced(older: SdoJob, job: SdoJob) -> bool:
        return older.data is not None and (older.index, older.subindex) == (job.index, job.subindex)

    def _advance(self, now: float) -> None:
        """Hand over what has ended, and begin what is next."""
        while True:
            result = self._client.take()
            if result is not None:
                job, self._running = self._running, None
                assert job is not None
                self._count(result, writing=job.data is not None)
                if not result.silent:
                    self.round_trip = now - self._begun
                job.done(result, now)
            elif self._running is None and self._waiting:
                self._begin(self._waiting.popleft(), now)
            else:
                return

    def _begin(self, job: SdoJob, now: float) -> None:
        self._running, self._begun = job, now
        client = self._client
        if job.data is None:
            self._give(client.upload(job.index, job.subindex, now))
        else:
            self._give(client.download(job.index, job.subindex, job.data, now))

    def _count(self, result: SdoResult, *, writing: bool) -> None:
        counters = self.counters
        counters.transfers += 1
        if result.silent:
            counters.timeouts += 1
        elif not result.good:
            counters.aborts += 1
            code, known = result.code or 0, counters.codes
            known[code if code in known or len(known) < MAX_CODES else AbortCode.GENERAL] += 1
            what = "write" if writing else "read"
            self.last_abort = f"{reason_of(result)}, {what} {object_text(result.index, result.subindex)}"

    def _give(self, frames: list[bytes]) -> None:
        for data in frames:
            self._send(Frame(self._request, data), Priority.ORDERED)


def reason_of(result: SdoResult) -> str:
    """Why a transfer has failed."""
    if result.silent:
        return "no answer"
    return abort_text(result.code) if result.code is not None else ""
