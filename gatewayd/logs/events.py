"""Brings the core's events into the log: names instead of indices, one line for each event.

What happens to many variables alike at one moment, say all bits of a word that another client has claimed, is one line.
"""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Iterable, Sequence
from contextlib import suppress

from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR, Variable
from gatewayd.core.events import Event, EventKind
from gatewayd.core.refusal import Reason
from gatewayd.logs.records import fields
from gatewayd.report.format import interval

LEVELS = {
    EventKind.ROBOT_LOST: logging.WARNING,
    EventKind.STALE: logging.WARNING,
    EventKind.UNAVAILABLE: logging.WARNING,
    EventKind.READ_BACK_DIFFERS: logging.WARNING,
    EventKind.ADOPTION_ENDS: logging.WARNING,
    EventKind.STOOD_STILL: logging.WARNING,
    EventKind.WRITER_LOST: logging.WARNING,
    EventKind.TAKEN_OVER: logging.WARNING,
    EventKind.FALLBACK: logging.WARNING,
    EventKind.REFUSED: logging.WARNING,
    EventKind.UNSERVED: logging.WARNING,
    EventKind.FORCED: logging.WARNING,
    EventKind.UNFORCED: logging.WARNING,
    EventKind.COMMAND_REFUSED: logging.WARNING,
    EventKind.ACQUIRED: logging.DEBUG,
    EventKind.RELEASED: logging.DEBUG,
}
"""Kinds that are not logged at INFO. Locks come and go with every lease, so they are for debugging and for the ring."""

_ASKED = (EventKind.REFUSED, EventKind.UNSERVED)
"""Kinds that may be about an undeclared peer."""
_ELEMENT = re.compile(r"(.*)\[(\d+)\]")


_Story = tuple[int, EventKind, dict[str, object]]
"""Level and event, without its variable."""


class EventLog:
    """A listener for one cell's event ring.

    In a running event loop an event of a variable is logged in the loop's next turn, together with those that follow it
    and differ in the variable alone. Events are logged in their order.
    """

    def __init__(self, cell: Cell) -> None:
        self._definition = cell.definition
        self._log = logging.getLogger("gatewayd.cell")
        self._waiting: _Story | None = None
        self._names: list[str] = []
        """Variables that the waiting event is about."""

    def __call__(self, event: Event) -> None:
        """Log the event."""
        level = _level(event)
        if not self._log.isEnabledFor(level):
            return
        story = level, event.kind, self._fields(event)
        if story != self._waiting:
            self._flush()
            self._waiting = story
        if event.variable is not None:
            self._names.append(self._definition.variables[event.variable].name)
            with suppress(RuntimeError):  # no loop runs
                asyncio.get_running_loop().call_soon(self._flush)
                return
        self._flush()

    def _flush(self) -> None:
        if self._waiting is None:
            return
        (level, kind, found), names = self._waiting, self._names
        self._waiting, self._names = None, []
        subject = {"variable" if len(names) == 1 else "variables": _ranges(names)} if names else {}
        self._log.log(level, kind.value, extra=fields(cell=self._definition.name, **subject, **found))

    def _fields(self, event: Event) -> dict[str, object]:
        definition = self._definition
        variable = definition.variables[event.variable] if event.variable is not None else None
        found: dict[str, object | None] = {
            "field": variable.field if variable is not None else None,
            "lock": definition.locks[event.lock].name
            if event.lock is not None and variable is None
            else None,
            "writer": self._writer(event.writer, unknown=event.kind in _ASKED),
            "peer": event.peer or None,
            "request": event.request or None,
            "holder" if event.kind is EventKind.REFUSED else "former": self._writer(event.other),
            "reason": event.reason.text if event.reason is not None else None,
            "limits": _limits(event, variable),
            "old": event.old,
            "new": event.new,
            "repeats": event.repeats or None,
            "detail": event.detail or None,
        }
        return {name: value for name, value in found.items() if value is not None}

    def _writer(self, index: int | None, *, unknown: bool = False) -> str | None:
        if index is None:
            return "undeclared" if unknown else None
        return self._definition.writer_name(index)


def _limits(event: Event, variable: Variable | None) -> str | None:
    """What would have been allowed, where a value was out of it."""
    limits = None if variable is None or event.reason is not Reason.OUT_OF_LIMITS else variable.limits
    return None if limits is None else interval(limits.low, limits.high)


def _level(event: Event) -> int:
    """What the local operator does is unusual, and logged with the default settings too."""
    return logging.WARNING if event.writer == OPERATOR else LEVELS.get(event.kind, logging.INFO)


def _ranges(names: Iterable[str]) -> str:
    """The names, elements that follow each other as `name[first..last]`."""
    runs: list[tuple[str, list[int]]] = []
    for name in names:
        element = _ELEMENT.fullmatch(name)
        base, numbers = (element[1], [int(element[2])]) if element else (name, [])
        if numbers and runs and runs[-1][0] == base and runs[-1][1][-1:] == [numbers[0] - 1]:
            runs[-1][1].extend(numbers)
        else:
            runs.append((base, numbers))
    return " ".join(base + _span(numbers) for base, numbers in runs)


def _span(numbers: Sequence[int]) -> str:
    if not numbers:
        return ""
    return f"[{numbers[0]}]" if len(numbers) == 1 else f"[{numbers[0]}..{numbers[-1]}]"
