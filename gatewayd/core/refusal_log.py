"""Reporting refusals without flooding: equal ones are counted and reported once per interval, and none is lost."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from gatewayd.core.events import Event, translated
from gatewayd.core.match import Match, at
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import host_of
from gatewayd.core.unserved import Unserved

MAX_PEERS = 64
"""Hosts without a writer whose refusals are counted apart."""
REFUSAL_INTERVAL = 10.0
"""Seconds in which equal refusals are counted instead of reported again: a PLC may retry a hundred times a second."""
_SHOWN = 0.05
"""Seconds that tenths can show."""


@dataclass(frozen=True, slots=True)
class LastRefusal:
    """What the status block shows of the last refusal."""

    refusal: Refusal
    writer: int | None
    time: float
    peer: str = ""
    """Address of the peer, where no writer is declared for it."""

    def translated(self, match: Match) -> LastRefusal:
        """With the new indices."""
        refusal = replace(
            self.refusal,
            variable=at(match.variables, self.refusal.variable),
            holder=at(match.writers, self.refusal.holder),
        )
        return replace(self, refusal=refusal, writer=at(match.writers, self.writer))


@dataclass(slots=True)
class _Reported:
    """When a refusal was last reported, and what has come since."""

    time: float
    pending: int = 0
    last: Event | None = None
    various: bool = False
    """Not all of what was counted asked for the same."""

    def count(self, event: Event) -> None:
        """One more, in the interval."""
        self.pending += 1
        self.various |= self.last is not None and self.last.request != event.request
        self.last = event

    def details(self, *more: str) -> str:
        """What the event says besides itself."""
        assert self.last is not None
        return ", ".join(filter(None, (self.last.detail, "others among them" if self.various else "", *more)))


_Key = tuple[int | None, str, int | None, Reason | Unserved | None, int | None]


def _ago(duration: float) -> str:
    """`8.0 s ago`; `just now` where the figure would be 0."""
    return f"{duration:.1f} s ago" if duration >= _SHOWN else "just now"


class RefusalLog:
    """Refusals are equal if writer, host of the peer, variable, reason and holder are.

    Each reported event stands for `1 + repeats` refusals, all of which it is true for. Where more than `MAX_PEERS`
    undeclared hosts are refused within one interval, those of further ones are counted together, under no address.
    """

    def __init__(self, report: Callable[[Event], None]) -> None:
        self._report = report
        self._reported: dict[_Key, _Reported] = {}
        self._peers: set[str] = set()
        """Undeclared hosts in `_reported`."""
        self._next = math.inf

    def add(self, event: Event) -> None:
        """A request was refused: report it, or count it if an equal one was reported within the interval."""
        host = host_of(event.peer)
        if host and host not in self._peers:
            if len(self._peers) < MAX_PEERS:
                self._peers.add(host)
            else:
                host, event = "", replace(event, peer="", detail="one of many peers")
        key = (event.writer, host, event.variable, event.reason, event.other)
        reported = self._reported.get(key)
        if reported is not None and event.time - reported.time < REFUSAL_INTERVAL:
            reported.count(event)
            return
        if reported is not None and reported.last is not None:
            reported.count(event)
            event = replace(event, repeats=reported.pending - 1, detail=reported.details())
        self._report(event)
        self._reported[key] = _Reported(event.time)
        self._next = min(self._next, event.time + REFUSAL_INTERVAL)

    def tick(self, now: float) -> None:
        """Report what was only counted in an interval that has ended, and forget what was not refused again."""
        if now < self._next:
            return
        for key, reported in list(self._reported.items()):
            if now - reported.time < REFUSAL_INTERVAL:
                continue
            if reported.last is None:
                del self._reported[key]
                continue
            ago = _ago(now - reported.last.time)
            detail = reported.details(ago if reported.pending == 1 else f"the last {ago}")
            self._report(replace(reported.last, time=now, repeats=reported.pending - 1, detail=detail))
            self._reported[key] = _Reported(now)
        self._peers = {host for _, host, _, _, _ in self._reported if host}
        self._next = min(
            (reported.time + REFUSAL_INTERVAL for reported in self._reported.values()), default=math.inf
        )

    def succeed(self, former: RefusalLog, match: Match) -> None:
        """Go on counting what `former` counts; of what is gone, report what was only counted."""
        for (writer, host, variable, reason, holder), reported in former._reported.items():
            indices = (writer, match.writers), (variable, match.variables), (holder, match.writers)
            if all(index is None or index in successors for index, successors in indices):
                key = (
                    at(match.writers, writer),
                    host,
                    at(match.variables, variable),
                    reason,
                    at(match.writers, holder),
                )
                reported.last = translated(reported.last, match) if reported.last is not None else None
                self._reported[key] = reported
            elif reported.last is not None:
                self._report(translated(replace(reported.last, repeats=reported.pending - 1), match))
        self._peers = set(former._peers)
        self._next = former._next
