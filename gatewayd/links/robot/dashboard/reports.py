"""Refused commands as events: each of its kind at once, and then once in a while with the number of the others."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from gatewayd.core.events import Event
from gatewayd.core.refusal_log import REFUSAL_INTERVAL
from gatewayd.links.robot.dashboard.results import CommandResult


@dataclass(slots=True)
class _Reported:
    time: float = -math.inf
    counted: int = 0


class RefusalReports:
    """A PLC may write a command in every cycle. Refusals are equal if variable, writer and result are."""

    def __init__(self) -> None:
        self._reported: dict[tuple[int | None, int | None, CommandResult], _Reported] = {}

    def add(self, event: Event, result: CommandResult, record: Callable[[Event], None]) -> None:
        """Report a refusal, or count it if an equal one was reported within the interval."""
        reported = self._reported.setdefault((event.variable, event.writer, result), _Reported())
        if event.time - reported.time < REFUSAL_INTERVAL:
            reported.counted += 1
            return
        record(replace(event, repeats=reported.counted))
        reported.time, reported.counted = event.time, 0

    def forget(self) -> None:
        """Indices mean something else now."""
        self._reported.clear()
