"""What can be asked of a running gateway and done to it, as plain values for JSON; no socket and no HTTP.

The control socket and the status page answer from here. Queries take what came with the request as texts; whatever is
wrong with it is an `ApiError`, which says what to do.
"""

from __future__ import annotations

import logging
import math
import os
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from gatewayd import __version__
from gatewayd.audit.record import Record, utc
from gatewayd.audit.trail import Audit
from gatewayd.control.access import Caller
from gatewayd.control.names import NamePattern
from gatewayd.control.packages import PackageFeeds
from gatewayd.control.trace import TracedGateway, Traces
from gatewayd.control.views import (
    Declarations,
    cell_view,
    event_view,
    lock_view,
    record_view,
    variable_state,
    variable_view,
)
from gatewayd.core.definition import Value, ValueKind
from gatewayd.core.events import Event, EventKind, EventRing
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.links.contract import DutyLink
from gatewayd.logs.records import fields
from gatewayd.loop.share import LoopShare
from gatewayd.report.format import interval
from gatewayd.report.schema import EventMessage, Json, LockStatus, Status, VersionInfo
from gatewayd.report.verdict import ServedCell

API_VERSION = 1
STALE_ACT = 0.5
"""Seconds that an act of the operator may have waited while the gateway stood still."""
MAX_FORCE = 24 * 3600.0
"""Seconds that a force may last at most; it can be renewed."""
log = logging.getLogger("gatewayd.control")

_MAX_VALUE = sys.float_info.max
_KINDS_OF_EVENTS = tuple(kind.value for kind in EventKind)
_Item = TypeVar("_Item")
_MAX_ANSWER = 1000
"""Events or records in one answer."""
NEWS = 100
"""Events of one cell that a follower gets at one time; the rest comes with the next look."""
Work = Generator[None, None, Json]
"""An answer in the making: it pauses after each short step. Its values are of one moment, however long it takes."""


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
        *,
        traced: TracedGateway | None = None,
    ) -> None:
        self._stood_still = stood_still
        self.gateway = gateway
        self.audited = audit
        self._notes = notes
        self._declarations = Declarations()
        self.traces = Traces(traced) if traced is not None else None
        """What passes the links of `traced`; for the control socket alone."""
        self.feeds = PackageFeeds(gateway)
        """Packages of the robots, for recordings; for the control socket alone."""
        self.share = LoopShare()
        """Of the loop's time, for answers."""

    # -- questions -----------------------------------------------------------------------------------------------

    def version(self) -> VersionInfo:
        """Versions of the interface and of the program."""
        return VersionInfo(api=API_VERSION, version=__version__, pid=os.getpid())

    def status(self, moment: Moment) -> Generator[None, None, Status]:
        """Everything at a glance."""
        runtimes, cells = self.gateway.runtimes, []
        for runtime in runtimes:
            cells.append(cell_view(runtime, self._declarations.of(runtime.plan), moment.now))
            yield
        troubles = [*self._notes(), *self.gateway.troubles()]
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

    def variables(self, query: Mapping[str, str], moment: Moment) -> Work:
        """All variables; `cell` and `name` (with * and ?) choose some."""
        wanted = []
        for runtime in self._runtimes(query.get("cell")):
            indices = yield from _named(runtime, query.get("name"))
            states = [variable_state(runtime, index, moment.now) for index in indices]
            wanted.append((self._declarations.of(runtime.plan).variables, indices, states))
        found: list[Json] = []
        for declared, indices, states in wanted:
            for index, state in zip(indices, states, strict=True):
                found.append(variable_view(declared[index], state))
                yield
        return {"time": utc(moment.wall), "variables": found}

    def locks(self, query: Mapping[str, str], moment: Moment) -> Work:
        """All locks; `cell` chooses those of one cell."""
        found = []
        for runtime in self._runtimes(query.get("cell")):
            for index in range(len(runtime.cell.definition.locks)):
                found.append(lock_view(runtime.cell, index, moment.now))
                yield
        return {"time": utc(moment.wall), "locks": found}

    def events(self, query: Mapping[str, str], moment: Moment) -> Work:
        """The last events, oldest first; `cell`, `kind`, `limit` (100), and `after` with a number of that cell."""
        limit, after = _count(query, "limit", 100), _count(query, "after", 0, most=2**53)
        runtimes = self._runtimes(query.get("cell"))
        if after and len(runtimes) > 1:
            raise ApiError(400, "bad_query", "`after` counts the events of one cell: say which with `cell`")
        latest = sorted(
            (event.time, number, name, event)
            for name, runtime in enumerate(runtimes)
            for number, event in _latest(runtime.cell.events, after, query.get("kind"), limit)
        )
        found = []
        for _time, number, name, event in _last(latest, limit):
            found.append(event_view(runtimes[name].cell, number, event, moment.now, moment.wall))
            yield
        return {"time": utc(moment.wall), "events": found}

    def new_events(self, cursor: Cursor, query: Mapping[str, str], moment: Moment) -> list[EventMessage]:
        """What happened since the cursor was used last, `NEWS` events of each cell at most, and move it.

        A fresh cursor begins now. The ring is the only buffer: who asks too seldom misses what it has forgotten, and
        sees it by `seq`.
        """
        found: list[tuple[float, EventMessage]] = []
        for runtime in self._runtimes(query.get("cell")):
            ring, name = runtime.cell.events, runtime.cell.definition.name
            read = cursor.get(name, ring.count)
            if read != ring.count:
                news = ring.since(read if read < ring.count else 0)[:NEWS]
                read = news[-1][0] if news else ring.count
                found += [
                    (event.time, event_view(runtime.cell, number, event, moment.now, moment.wall))
                    for number, event in news
                ]
            cursor[name] = read
        return [event for _, event in sorted(found, key=lambda timed: (timed[0], timed[1]["seq"]))]

    def has_news(self, cursor: Cursor, query: Mapping[str, str]) -> bool:
        """Whether `new_events` would find any. Cheap."""
        runtimes = self._runtimes(query.get("cell"))
        return any(
            cursor.get(runtime.cell.definition.name) != runtime.cell.events.count for runtime in runtimes
        )

    def audit(self, query: Mapping[str, str], moment: Moment) -> Work:
        """The last records, oldest first; `cell`, `variable`, `writer` and `limit` (100) choose some."""
        limit = _count(query, "limit", 100)
        if "cell" in query:
            self._runtimes(query["cell"])
        wanted = [record for record in self.audited if _is_wanted(record, query)]
        found = []
        for record in _last(wanted, limit):
            found.append(record_view(record))
            yield
        return {"time": utc(moment.wall), "records": found}

    # -- acts of the local operator ------------------------------------------------------------------------------

    def refuse_what_waited(self) -> None:
        """Raise ApiError if what arrives now may have waited for long while the gateway stood still.

        Its sender may have given up since, and the plant is no longer as they saw it.
        """
        seconds = self._stood_still()
        if seconds > STALE_ACT:
            raise ApiError(
                503, "stood_still", f"the gateway stood still for {seconds:.1f} s; repeat the command"
            )

    def take(self, name: str, body: Mapping[str, Any], caller: Caller, moment: Moment) -> LockStatus:
        """Take a lock; `for` seconds, or until it is released. The lock as it is then."""
        runtime, lock = self._lock(name, body)
        seconds = _seconds(body, required=False)
        _refuse_standing_by(runtime)
        until = moment.now + seconds
        runtime.cell.operator.take_lock(lock, moment.now, until, caller.detail, caller.holder)
        return lock_view(runtime.cell, lock, moment.now)

    def release(self, name: str, body: Mapping[str, Any], caller: Caller, moment: Moment) -> LockStatus:
        """Release a lock of any owner. The lock as it is then."""
        runtime, lock = self._lock(name, body)
        if not runtime.cell.operator.free_lock(lock, moment.now, caller.detail):
            raise ApiError(409, "not_owned", f"nobody owns {name}")
        return lock_view(runtime.cell, lock, moment.now)

    def force(self, name: str, body: Mapping[str, Any], caller: Caller, moment: Moment) -> Json:
        """Force a variable to `value` `for` some seconds. The variable as it is then."""
        runtime, index = self._variable(name, body)
        cell = runtime.cell
        variable = cell.definition.variables[index]
        value = _value(variable.kind, body.get("value"))
        seconds = _seconds(body, required=True)
        _refuse_standing_by(runtime)
        refusal = cell.operator.force(
            index, value, moment.now, moment.now + seconds, caller.detail, caller.holder
        )
        if refusal is not None:
            raise ApiError(409, _CODES[refusal.reason], f"{name} cannot be forced: {_why(refusal, runtime)}")
        return self._view(runtime, index, moment)

    def unforce(self, name: str, body: Mapping[str, Any], caller: Caller, moment: Moment) -> Json:
        """End a force. The variable as it is then."""
        runtime, index = self._variable(name, body)
        if not runtime.cell.operator.unforce(index, moment.now, caller.detail):
            raise ApiError(409, "not_forced", f"{name} is not forced")
        return self._view(runtime, index, moment)

    def hand_over(self, name: str, body: Mapping[str, Any], caller: Caller, moment: Moment) -> Json:
        """Leave the cell of this name to the other gateway. Its status at that moment."""
        (runtime,) = self._runtimes(name)
        link = next((link for link in runtime.links.values() if isinstance(link, DutyLink)), None)
        if link is None:
            raise ApiError(409, "no_standby", f"there is no second gateway for {name}: its mapping has none")
        why = link.hand_over(moment.now)
        if why:
            raise ApiError(409, "not_handed_over", why)
        log.warning("cell handed over", extra=fields(cell=name, detail=caller.detail))
        return cell_view(runtime, self._declarations.of(runtime.plan), moment.now)

    # -- inside --------------------------------------------------------------------------------------------------

    def _runtimes(self, cell: str | None) -> Sequence[ServedCell]:
        if cell is None:
            return self.gateway.runtimes
        found = [runtime for runtime in self.gateway.runtimes if runtime.cell.definition.name == cell]
        if not found:
            names = ", ".join(runtime.cell.definition.name for runtime in self.gateway.runtimes)
            raise ApiError(404, "no_such_cell", f"there is no cell {cell}, only {names}")
        return found

    def _view(self, runtime: ServedCell, index: int, moment: Moment) -> Json:
        declared = self._declarations.of(runtime.plan).variables[index]
        return variable_view(declared, variable_state(runtime, index, moment.now))

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
            return f"{refusal.reason.text}, {interval(limits.low, limits.high)}"
    return refusal.reason.text


def _refuse_standing_by(runtime: ServedCell) -> None:
    """What somebody takes or forces here would act on nothing, and come to act when this gateway takes over."""
    why = runtime.cell.standing_by
    if why:
        raise ApiError(409, "standing_by", f"{why}; do it at the gateway that serves the cell")


def _only(found: list[tuple[ServedCell, int]], what: str, name: str) -> tuple[ServedCell, int]:
    if not found:
        raise ApiError(404, f"no_such_{what}", f"there is no {what} {name}")
    if len(found) > 1:
        cells = ", ".join(runtime.cell.definition.name for runtime, _index in found)
        raise ApiError(409, "ambiguous", f"{name} is in several cells ({cells}): say which with `cell`")
    return found[0]


def _named(runtime: ServedCell, pattern: str | None) -> Generator[None, None, Sequence[int]]:
    """The variables whose names fit; `*` and `?` are wildcards."""
    variables = runtime.cell.definition.variables
    if pattern is None:
        return range(len(variables))
    try:
        wanted = NamePattern(pattern)
    except ValueError as error:
        raise ApiError(400, "bad_query", f"`name` {error}") from None
    found = []
    for index, variable in enumerate(variables):
        if wanted.fits(variable.name):
            found.append(index)
        yield
    return found


def _latest(ring: EventRing, after: int, kind: str | None, limit: int) -> Sequence[tuple[int, Event]]:
    if kind is None:
        return ring.since(after, limit)
    if kind not in _KINDS_OF_EVENTS:
        raise ApiError(400, "bad_query", f"`kind` must be one of: {', '.join(_KINDS_OF_EVENTS)}")
    return _last([kept for kept in ring.since(after) if kept[1].kind.value == kind], limit)


def _last(found: Sequence[_Item], limit: int) -> Sequence[_Item]:
    return found[max(0, len(found) - limit) :]


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
