"""Since when things are as they are in a test, and why: for the words of a failure."""

from __future__ import annotations

import math

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, FallbackKind, Value, Variable
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.report.format import exact, interval, seconds

_OWNERSHIP = (EventKind.ACQUIRED, EventKind.TAKEN_OVER, EventKind.RELEASED)
_SOURCES = {
    Source.LOST: "is not connected",
    Source.WAITING: "has not reported yet",
    Source.FRESH: "reports",
    Source.SILENT: "is silent",
    Source.FROZEN: "stands still",
    Source.LATE: "reports too late",
}
_SILENT = "no request for"
"""In the words of the core for a writer whose time-out has passed."""


class Explanation:
    """Explains the state of a cell from the events that it has had. Variables and locks are indices."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._changes: dict[int, Event] = {}
        """The last change of ownership, by lock."""
        cell.events.listeners.append(self._note)

    def owner(self, lock: int) -> str:
        """Who owns a lock, and since when: `owner plc since 1 s`, `free since 2 s: lease ended`."""
        owner, change = self._cell.ownership.owners[lock], self._changes.get(lock)
        since = f" since {seconds(change.time)}" if change is not None else ""
        if owner is not None:
            return f"owner {self._cell.definition.writer_name(owner)}{since}"
        return f"free{since}: {change.detail}" if change is not None else "nobody has owned it"

    def source(self, index: int) -> str:
        """The state of the robot as the source of a variable, and of its register."""
        if not self._cell.image.available[index]:
            return "another client has its register"
        return f"the robot {_SOURCES[self._cell.freshness.state]}"

    def circumstances(self, index: int) -> str:
        """What decides the value of a variable now: its owner, or the robot as its source."""
        lock = self._cell.definition.variables[index].lock
        if lock is not None:
            return self.owner(lock)
        return f"quality {self._cell.image.quality[index].name.lower()}, {self.source(index)}"

    def hint(self, index: int) -> str:
        """What in the mapping makes the value of a variable what it is, or its owner."""
        variable = self._cell.definition.variables[index]
        if variable.direction is Direction.OUTPUT or variable.lock is None:
            policy = _policy(variable.on_stale.kind, variable.on_stale.value)
            return f"while it is not good, a fieldbus sees its `on_stale`: {policy}"
        owner = self._cell.ownership.owners[variable.lock]
        return self._released(variable, variable.lock) if owner is None else self._end(variable.lock, owner)

    def quality_hint(self, _index: int) -> str:
        """What in the mapping decides the quality of a variable."""
        limit = seconds(self._cell.definition.stale_after)
        return f"values are stale while the robot is not connected, or silent for {limit} (`stale_after`)"

    def refusal(self, refusal: Refusal) -> str:
        """A refusal in words: `held by another owner: speed (owner plc since 1 s)`."""
        if refusal.variable is None:
            return refusal.reason.text
        variable = self._cell.definition.variables[refusal.variable]
        detail = ""
        if refusal.reason is Reason.HELD and variable.lock is not None:
            detail = self.owner(variable.lock)
        elif refusal.reason is Reason.OUT_OF_LIMITS:
            detail = _range(variable)
        return f"{refusal.reason.text}: {variable.name}" + (f" ({detail})" if detail else "")

    # -- inside --------------------------------------------------------------------------------------------------

    def _note(self, event: Event) -> None:
        if event.kind in _OWNERSHIP and event.lock is not None:
            self._changes[event.lock] = event

    def _released(self, variable: Variable, lock: int) -> str:
        policy = _policy(variable.on_release.kind, variable.on_release.value)
        hint = f"a release gives the robot its `on_release`: {policy}"
        change = self._changes.get(lock)
        if change is not None and change.writer is not None and _SILENT in change.detail:
            hint += (
                f"; `alive: {self._cell.definition.writer_name(change.writer)}` beside `after` has it go on"
            )
        return hint

    def _end(self, lock: int, owner: int) -> str:
        """When an ownership ends by itself."""
        cell = self._cell
        name, writers = cell.definition.writer_name(owner), cell.definition.writers
        timeout = writers[owner].timeout if owner < len(writers) else None
        ends = []
        if math.isfinite(cell.ownership.expires[lock]):
            ends.append(f"its lease at {_at(cell.ownership.expires[lock])}")
        if timeout is not None:
            ends.append(f"its time-out at {_at(cell.writers.last_seen[owner] + timeout)}")
        if ends:
            return f"what ends the ownership of {name} by itself: {' or '.join(ends)}"
        return f"nothing ends the ownership of {name} by itself: it has neither a `lease` nor a `timeout`"


def _range(variable: Variable) -> str:
    if variable.limits is not None:
        return f"limits {interval(variable.limits.low, variable.limits.high)}"
    if variable.low is not None and variable.high is not None:
        return f"whole numbers {interval(variable.low, variable.high)}"
    return ""


def _policy(kind: FallbackKind, value: Value | None) -> str:
    if value is None:
        return kind.value
    return str(value).lower() if isinstance(value, bool) else exact(value)


def _at(time: float) -> str:
    return seconds(round(time, 6))
