"""Whose turn it is on a line. Pure; seconds of any one clock.

Each turn goes to the station with something due that has waited longest for one, so that a unit with much to say takes
no more turns than one with little. Writes go before reads, but not more than MAX_WRITES_IN_ROW while a read waits.

Lost units are probed within their budget, one after the other. Without regard to it a unit is probed once that may be
back: after its loss, behind a new connection, and when the first of those that were all lost answers again. Between two
probes in vain everybody who answers has a turn, so that time-outs do not add up to somebody else's loss.
"""

from __future__ import annotations

from gatewayd.modbus.client.breaker import BreakerState
from gatewayd.modbus.client.polling import AT_ONCE, NEVER
from gatewayd.modbus.client.probes import ProbeBudget
from gatewayd.modbus.client.requests import ExceptionAnswer, Failure
from gatewayd.modbus.client.station import Job, Station

MAX_WRITES_IN_ROW = 2


class Turns:
    """The stations of a line, and which of them is next."""

    def __init__(self, probe_share: float) -> None:
        self.stations: list[Station] = []
        self._budget = ProbeBudget(probe_share)
        self._number = 0
        self._writes_in_row = 0
        self._may_be_back: set[Station] = set()
        self._probe: Job | None = None
        self._failed_probe_at = 0
        """Turn after the last probe in vain."""

    @property
    def is_anybody_there(self) -> bool:
        """Whether any unit answers, whom probes would cost time."""
        for station in self.stations:  # noqa: SIM110 - asked several times for each answer; `any` takes thrice as long
            if station.breaker.state is BreakerState.CLOSED:
                return True
        return False

    def add(self, station: Station) -> None:
        """Another one."""
        self.stations.append(station)
        station.served = 0
        self._may_be_back.add(station)

    def remove(self, station: Station) -> None:
        """One goes."""
        self.stations.remove(station)
        self._may_be_back.discard(station)

    def forget(self, job: Job) -> None:
        """It is no longer known whose job that was."""
        if job is self._probe:
            self._probe = None

    def may_be_back(self, station: Station) -> None:
        """It was just lost, or is behind a connection that is new."""
        self._may_be_back.add(station)

    def due_at(self) -> float:
        """When somebody has something to send."""
        allowed = self._probes_allowed()
        due = NEVER
        for station in self.stations:
            due = min(due, station.write_due)
            if station.read_due < due:
                due = min(due, self._read_due(station, allowed))
        return due

    def next(self, now: float) -> Job | None:
        """What is sent now, if anything."""
        writing, reading = self._waiting(now)
        self._number += 1
        if writing is not None and (reading is None or self._writes_in_row < MAX_WRITES_IN_ROW):
            self._writes_in_row += 1
            writing.served = self._number
            return writing.take_write(now)
        if reading is None:
            return None
        self._writes_in_row = 0
        reading.served = self._number
        job = reading.take_read(now)
        if job.is_probe:
            self._probe = job
            self._may_be_back.discard(reading)
        return job

    def finish(self, job: Job, outcome: bytes | Failure, now: float) -> None:
        """Hand the outcome to whose job it is, and draw the consequences of a unit that is lost or found by it."""
        self.forget(job)
        station, was_anybody_there = job.station, self.is_anybody_there
        was_closed = station is not None and station.breaker.is_closed
        job.done(job, outcome, now)
        if station is not None and not station.breaker.is_closed:
            if was_closed or isinstance(
                outcome, bytes
            ):  # bytes: it answers, but perhaps to an earlier request
                self._may_be_back.add(station)
            if job.is_probe:
                # Bytes that are no answer may have cost others theirs.
                least = 0.0 if isinstance(outcome, (bytes, ExceptionAnswer)) else job.timeout
                self._budget.spend(max(now - job.sent_at, least), now)
                self._failed_probe_at = self._number + 1
        if not was_anybody_there and self.is_anybody_there:
            # What was off altogether comes back together: nobody waits for those that stay away.
            self._may_be_back.update(self.stations)

    def _probes_allowed(self) -> tuple[float, float]:
        """When the next probe may go out, one after the other: to a unit that stays away, to one that may be back."""
        if not self.is_anybody_there:
            return AT_ONCE, AT_ONCE
        return (self._budget.free_at, AT_ONCE) if self._probe is None else (NEVER, NEVER)

    def _read_due(self, station: Station, allowed: tuple[float, float]) -> float:
        if station.breaker.state is BreakerState.CLOSED:
            return station.read_due
        return max(station.read_due, allowed[station in self._may_be_back])

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
        """Who has waited longer; but nobody is probed while somebody who answers waits for a turn since the last."""
        if polled is None or probed is None:
            return polled or probed
        return polled if polled.served < max(probed.served, self._failed_probe_at) else probed
