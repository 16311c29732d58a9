"""Tells the core's events to the log: names instead of indices, one line for each event."""

from __future__ import annotations

import logging

from gatewayd.core.cell import Cell
from gatewayd.core.events import Event, EventKind
from gatewayd.logs import fields

__all__ = ["LEVELS", "EventLog"]

LEVELS = {
    EventKind.ROBOT_LOST: logging.WARNING,
    EventKind.STALE: logging.WARNING,
    EventKind.UNAVAILABLE: logging.WARNING,
    EventKind.READ_BACK_DIFFERS: logging.WARNING,
    EventKind.WRITER_LOST: logging.WARNING,
    EventKind.TAKEN_OVER: logging.WARNING,
    EventKind.FALLBACK: logging.WARNING,
    EventKind.REFUSED: logging.WARNING,
    EventKind.ACQUIRED: logging.DEBUG,
    EventKind.RELEASED: logging.DEBUG,
}
"""Kinds that are not told at INFO. Locks come and go with every lease, so they are for debugging and for the ring."""


class EventLog:
    """A listener for one cell's event ring."""

    def __init__(self, cell: Cell) -> None:
        self._definition = cell.definition
        self._log = logging.getLogger("gatewayd.cell")

    def __call__(self, event: Event) -> None:
        """Log the event."""
        level = LEVELS.get(event.kind, logging.INFO)
        if self._log.isEnabledFor(level):
            self._log.log(level, event.kind.value, extra=fields(**self._fields(event)))

    def _fields(self, event: Event) -> dict[str, object]:
        definition = self._definition
        variable = definition.variables[event.variable] if event.variable is not None else None
        found: dict[str, object | None] = {
            "cell": definition.name,
            "variable": variable.name if variable is not None else None,
            "field": variable.field if variable is not None else None,
            "lock": definition.locks[event.lock].name
            if event.lock is not None and variable is None
            else None,
            "writer": self._writer(event.writer, unknown=event.kind is EventKind.REFUSED),
            "holder" if event.kind is EventKind.REFUSED else "former": self._writer(event.other),
            "reason": event.reason.text if event.reason is not None else None,
            "old": event.old,
            "new": event.new,
            "repeats": event.repeats or None,
            "detail": event.detail or None,
        }
        return {name: value for name, value in found.items() if value is not None}

    def _writer(self, index: int | None, *, unknown: bool = False) -> str | None:
        if index is None:
            return "undeclared" if unknown else None
        return self._definition.writers[index].name
