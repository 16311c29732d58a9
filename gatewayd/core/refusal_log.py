"""Telling refusals without flooding: equal ones are counted and told once per interval, and none is lost."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from gatewayd.core.events import Event, translated
from gatewayd.core.match import Match, at
from gatewayd.core.refusal import Reason, Refusal

__all__ = ["REFUSAL_INTERVAL", "LastRefusal", "RefusalLog"]

REFUSAL_INTERVAL = 10.0
"""Seconds in which equal refusals are counted instead of told again: a PLC may retry a hundred times a second."""


@dataclass(frozen=True, slots=True)
class LastRefusal:
    """What the status block tells of the last refusal."""

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
class _Told:
    """When a refusal was last told, and what has come since."""

    time: float
    untold: int = 0
    last: Event | None = None


class RefusalLog:
    """Refusals are equal if writer, variable and reason are. Each told event stands for `1 + repeats` refusals."""

    __slots__ = ("_next", "_tell", "_told")

    def __init__(self, tell: Callable[[Event], None]) -> None:
        self._tell = tell
        self._told: dict[tuple[int | None, int | None, Reason | None], _Told] = {}
        self._next = math.inf

    def add(self, event: Event) -> None:
        """A request was refused: tell it, or count it if an equal one was told within the interval."""
        key = (event.writer, event.variable, event.reason)
        told = self._told.get(key)
        if told is not None and event.time - told.time < REFUSAL_INTERVAL:
            told.untold += 1
            told.last = event
            return
        self._tell(event if told is None else replace(event, repeats=told.untold))
        self._told[key] = _Told(event.time)
        self._next = min(self._next, event.time + REFUSAL_INTERVAL)

    def tick(self, now: float) -> None:
        """Tell what was only counted in an interval that has ended, and forget what was not refused again."""
        if now < self._next:
            return
        for key, told in list(self._told.items()):
            if now - told.time < REFUSAL_INTERVAL:
                continue
            if told.last is None:
                del self._told[key]
                continue
            detail = f"the last {now - told.last.time:.1f} s ago"
            self._tell(replace(told.last, time=now, repeats=told.untold - 1, detail=detail))
            self._told[key] = _Told(now)
        self._next = min((told.time + REFUSAL_INTERVAL for told in self._told.values()), default=math.inf)

    def succeed(self, former: RefusalLog, match: Match) -> None:
        """Go on counting what `former` counts; of what is gone, tell what was only counted."""
        for (writer, variable, reason), told in former._told.items():
            if (writer is None or writer in match.writers) and (
                variable is None or variable in match.variables
            ):
                key = at(match.writers, writer), at(match.variables, variable), reason
                told.last = translated(told.last, match) if told.last is not None else None
                self._told[key] = told
            elif told.last is not None:
                self._tell(translated(replace(told.last, repeats=told.untold - 1), match))
        self._next = former._next
