"""What can be asked of a running gateway and done to it, as plain values for JSON; no socket and no HTTP.

The control socket and the status page answer from here. Queries take what came with the request as texts; whatever is
wrong with it is an `ApiError`, which says what to do.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Protocol

from gatewayd import __version__
from gatewayd.control.views import (
    Declarations,
    cell_view,
    event_view,
    lock_view,
    record_view,
    variable_view,
)
from gatewayd.core.definition import Value, ValueKind
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.report.schema import EventMessage, Json, LockStatus, Status, VersionInfo
from gatewayd.report.verdict import ServedCell
from gatewayd.service.audit import Audit, Record, utc

API_VERSION = 1
STALE_ACT = 0.5
"""Seconds that an act of the operator may have waited while the gateway stood still."""
MAX_FORCE = 24 * 3600.0
"""Seconds that a force may last at most; it can be renewed."""
_MAX_VALUE = sys.float_info.max
_MAX_ANSWER = 1000
"""Events or records in one answer."""


class ApiError(Exception):
    """A request that cannot be answered: HTTP status, a code for programs, a text for people."""

    def __init__(self, status: int, code: str, message: str) -> None:
        super().__init__(message)
        self.status, self.code, self.message = status, code, message

    def as_json(self) -> Json:
        """`{"error": {"code": ..., "message": ...}}`."""
        return {"error": {"code": self.code, "message": self.message}}


class Gateway(Protocol):
    """What the interface needs to know of the daemon."""

    @property
    def runtimes(self) -> Sequence[ServedCell]:
        """The cells that are served now."""

    def troubles(self) -> Sequence[str]:
        """What is wrong with the gateway as a whole."""


@dataclass(frozen=True, slots=True)
class Moment:
    """One moment on both clocks."""

    now: float
    """Monotonic seconds."""
    wall: float
    """Seconds since 1970, UTC."""


Cursor = dict[str, int]
"""How far somebody has read the events of each cell, by its name."""


class Api:
    """The interface to one gateway. `notes` are standing troubles that no link reports.

    `stood_still` is for how many seconds the process stood still until just now; 0.0: it did not.
    """

    def __init__(
        self,
        gateway: Gateway,
        audit: Audit,
        notes: Callable[[], Sequence[str]] = lambda: (),
        stood_still: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self._stood_still = stood_still
        self._gateway = gateway
        self._audit = audit
        self._notes = notes
        self._declarations = Declarations()

    # -- questions -----------------------------------------------------------------------------------------------

    def version(self) -> VersionInfo:
        """Versions of the interface and of the program."""
        return VersionInfo(api=API_VERSION, version=__version__, pid=os.getpid())

    def status(self, moment: Moment) -> Status:
        """Everything at a glance."""
        runtimes = self._gateway.runtimes
        cells = [cell_view(runtime, self._declarations.of(runtime.plan), moment.now) for runtime in runtimes]
        troubles = [*self._notes(), *self._gateway.troubles()]
        troubles += [f"{cell['name']}: {problem}" for cell in cells for problem in cell["problems"]]
        started = min((runtime.cell.health.started for runtime in runtimes), default=math.inf)
        return Status(
            **self.version(),
            time=utc(moment.wall),
            uptime=round(max(0.0, moment.now - started), 3) if math.isfinite(started) else 0.0,
            healthy=not troubles,
            problems=troubles,
            cells=cells,
        )

    def variables(self, query: Mapping[str, str], moment: Moment) -> Json:
        """All variables; `cell` and `name` (with * and ?) choose some."""
        pattern = query.get("name", "*")
        return {
            "time": utc(moment.wall),
            "variables": [
                self._view(runtime, index, moment)
                for runtime in self._runtimes(query.get("cell"))
                for index, variable in enumerate(runtime.cell.definition.variables)
                if fnmatchcase(variable.name, pattern) or variable.name == pattern
            ],
        }

    def locks(self, query: Mapping[str, str], moment: Moment) -> Json:
        """All locks; `cell` chooses those of one cell."""
        return {
            "time": utc(moment.wall),
            "locks": [
                lock_view(runtime.cell, index, moment.now)
                for runtime in self._runtimes(query.get("cell"))
                for index in range(len(runtime.cell.definition.locks))
            ],
        }

    def events(self, query: Mapping[str, str], moment: Moment) -> Json:
        """The last events, oldest first; `cell`, `limit` (100), and `after` with a sequence number of that cell."""
        limit, after = _count(query, "limit", 100), _count(query, "after", 0, most=2**53)
        runtimes = self._runtimes(query.get("cell"))
        if after and len(runtimes) > 1:
            raise ApiError(400, "bad_query", "`after` counts the events of one cell: say which with `cell`")
        found = _in_order(numbered for runtime in runtimes for numbered in _events(runtime, after, moment))
        return {"time": utc(moment.wall), "events": found[max(0, len(found) - limit) :]}

    def new_events(self, cursor: Cursor, query: Mapping[str, str], moment: Moment) -> list[EventMessage]:
        """What happened since the cursor was used last, and move it. A fresh cursor begins now.

        The ring is the only buffer: who asks too seldom misses what it has forgotten, and sees it by `seq`.
        """
        found: list[tuple[float, EventMessage]] = []
        for runtime in self._runtimes(query.get("cell")):
            ring, name = runtime.cell.events, runtime.cell.definition.name
            read = cursor.get(name, ring.count)
            if read != ring.count:
                found += _events(runtime, read if read < ring.count else 0, moment)
            cursor[name] = ring.count
        return _in_order(found)

    def audit(self, query: Mapping[str, str], moment: Moment) -> Json:
        """The last records, oldest first; `cell`, `variable`, `writer` and `limit` (100) choose some."""
        limit = _count(query, "limit", 100)
        if "cell" in query:
            self._runtimes(query["cell"])
        found = [record for record in self._audit if _is_wanted(record, query)]
        latest = found[max(0, len(found) - limit) :]
        return {"time": utc(moment.wall), "records": [record_view(record) for record in latest]}

    # -- acts of the local operator ------------------------------------------------------------------------------

    def refuse_what_waited(self) -> None:
        """Raise ApiError if what arrives now may have waited for long while the gateway stood still.

        Whoever sent it may have given up since, and the plant is no longer as they saw it.
        """
        seconds = self._stood_still()
        if seconds > STALE_ACT:
            raise ApiError(
                503, "stood_still", f"the gateway stood still for {seconds:.1f} s; repeat the command"
            )

    def take(self, name: str, body: Mapping[str, Any], who: str, moment: Moment) -> LockStatus:
        """Take a lock; `for` seconds, or until it is released. The lock as it is then."""
        runtime, lock = self._lock(name, body)
        seconds = _seconds(body, required=False)
        runtime.cell.operator.take_lock(lock, moment.now, moment.now + seconds, who)
        return lock_view(runtime.cell, lock, moment.now)

    def release(self, name: str, body: Mapping[str, Any], who: str, moment: Moment) -> LockStatus:
        """Release a lock, whoever holds it. The lock as it is then."""
        runtime, lock = self._lock(name, body)
        if not runtime.cell.operator.free_lock(lock, moment.now, who):
            raise ApiError(409, "not_owned", f"nobody owns {name}")
        return lock_view(runtime.cell, lock, moment.now)

    def force(self, name: str, body: Mapping[str, Any], who: str, moment: Moment) -> Json:
        """Force a variable to `value` `for` some seconds. The variable as it is then."""
        runtime, index = self._variable(name, body)
        cell = runtime.cell
        variable = cell.definition.variables[index]
        value = _value(variable.kind, body.get("value"))
        seconds = _seconds(body, required=True)
        refusal = cell.operator.force(index, value, moment.now, moment.now + seconds, who)
        if refusal is not None:
            raise ApiError(409, _CODES[refusal.reason], f"{name} cannot be forced: {_why(refusal, runtime)}")
        return self._view(runtime, index, moment)

    def unforce(self, name: str, body: Mapping[str, Any], who: str, moment: Moment) -> Json:
        """End a force. The variable as it is then."""
        runtime, index = self._variable(name, body)
        if not runtime.cell.operator.unforce(index, moment.now, who):
            raise ApiError(409, "not_forced", f"{name} is not forced")
        return self._view(runtime, index, moment)

    # -- inside --------------------------------------------------------------------------------------------------

    def _runtimes(self, cell: str | None) -> Sequence[ServedCell]:
        if cell is None:
            return self._gateway.runtimes
        found = [runtime for runtime in self._gateway.runtimes if runtime.cell.definition.name == cell]
        if not found:
            names = ", ".join(runtime.cell.definition.name for runtime in self._gateway.runtimes)
            raise ApiError(404, "no_such_cell", f"there is no cell {cell}; there is {names}")
        return found

    def _view(self, runtime: ServedCell, index: int, moment: Moment) -> Json:
        declared = self._declarations.of(runtime.plan).variables[index]
        return variable_view(declared, runtime.cell, index, moment.now)

    def _variable(self, name: str, body: Mapping[str, Any]) -> tuple[ServedCell, int]:
        found = [
            (runtime, index)
            for runtime in self._runtimes(_text(body, "cell"))
            for index, variable in enumerate(runtime.cell.definition.variables)
            if variable.name == name
        ]
        return _only(found, "variable", name)

    def _lock(self, name: str, body: Mapping[str, Any]) -> tuple[ServedCell, int]:
        """By the lock's own name, or by that of a variable that it guards."""
        found = []
        for runtime in self._runtimes(_text(body, "cell")):
            definition = runtime.cell.definition
            guarding = {variable.name: variable.lock for variable in definition.variables}
            named = {lock.name: index for index, lock in enumerate(definition.locks)}
            lock = named.get(name, guarding.get(name))
            if lock is not None:
                found.append((runtime, lock))
        return _only(found, "lock", name)


_CODES = {
    Reason.OUT_OF_LIMITS: "out_of_limits",
    Reason.ROBOT_LOST: "robot_lost",
    Reason.CLAIMED_ELSEWHERE: "claimed_elsewhere",
}


def _why(refusal: Refusal, runtime: ServedCell) -> str:
    if refusal.reason is Reason.OUT_OF_LIMITS and refusal.variable is not None:
        limits = runtime.cell.definition.variables[refusal.variable].limits
        if limits is not None:
            return f"{refusal.reason.text}, {limits.low:g}..{limits.high:g}"
    return refusal.reason.text


def _only(found: list[tuple[ServedCell, int]], what: str, name: str) -> tuple[ServedCell, int]:
    if not found:
        raise ApiError(404, f"no_such_{what}", f"there is no {what} {name}")
    if len(found) > 1:
        cells = ", ".join(runtime.cell.definition.name for runtime, _index in found)
        raise ApiError(409, "ambiguous", f"{name} is in several cells ({cells}): say which with `cell`")
    return found[0]


def _events(runtime: ServedCell, after: int, moment: Moment) -> Iterator[tuple[float, EventMessage]]:
    """The events that the ring still has, with sequence numbers beyond `after`."""
    ring, cell = runtime.cell.events, runtime.cell
    for seq, event in enumerate(ring, ring.count - len(ring) + 1):
        if seq > after:
            yield event.time, event_view(cell, seq, event, moment.now, moment.wall)


def _in_order(found: Iterable[tuple[float, EventMessage]]) -> list[EventMessage]:
    return [event for _, event in sorted(found, key=lambda timed: (timed[0], timed[1]["seq"]))]


def _is_wanted(record: Record, query: Mapping[str, str]) -> bool:
    event = record.event
    return all(
        query.get(name, its) == its
        for name, its in (("cell", record.cell), ("variable", event.variable), ("writer", event.writer))
    )


def _count(query: Mapping[str, str], name: str, default: int, most: int = _MAX_ANSWER) -> int:
    text = query.get(name)
    if text is None:
        return default
    if not (text.isascii() and text.isdigit()) or len(text) > 16 or int(text) > most:
        raise ApiError(400, "bad_query", f"`{name}` must be a whole number from 0 to {most}")
    return int(text)


def _text(body: Mapping[str, Any], name: str) -> str | None:
    value = body.get(name)
    if value is not None and not isinstance(value, str):
        raise ApiError(400, "bad_request", f"`{name}` must be a text")
    return value


def _seconds(body: Mapping[str, Any], *, required: bool) -> float:
    value = body.get("for")
    if value is None and not required:
        return math.inf
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= MAX_FORCE:
        raise ApiError(400, "bad_request", f"`for` must be seconds, more than 0 and at most {MAX_FORCE:.0f}")
    return float(value)


def _value(kind: ValueKind, value: object) -> Value:
    """The JSON value as one of the variable's kind: true is 1 for a bit only, 3.0 is 3 for an integer."""
    if kind is ValueKind.BOOL and value in (False, True):
        return bool(value)
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _MAX_VALUE:
        if kind is ValueKind.FLOAT:
            return float(value)
        if kind is ValueKind.INT and value == int(value):
            return int(value)
    raise ApiError(400, "bad_value", f"`value` must be {_KINDS[kind]}")


_KINDS = {
    ValueKind.BOOL: "true or false, 1 or 0",
    ValueKind.INT: "a whole number",
    ValueKind.FLOAT: "a number",
}
