"""Events, values and addresses in words, as the page shows them."""

from __future__ import annotations

from gatewayd.core.definition import CellDefinition, Value
from gatewayd.core.events import Event, EventKind
from gatewayd.mapping.plan import Area, Placement

__all__ = ["AREAS", "BAD", "address", "describe", "number"]

AREAS = {Area.COIL: "coil", Area.DISCRETE: "discrete", Area.INPUT: "input", Area.HOLDING: "holding"}
BAD = frozenset(
    {
        EventKind.ROBOT_LOST,
        EventKind.STALE,
        EventKind.UNAVAILABLE,
        EventKind.READ_BACK_DIFFERS,
        EventKind.WRITER_LOST,
        EventKind.REFUSED,
        EventKind.FORCED,
    }
)
"""Kinds of events that somebody should look at."""


def number(value: Value, unit: str = "") -> str:
    """A value for people: at most three decimals, and its unit."""
    if isinstance(value, bool):
        return "1" if value else "0"
    text = f"{value:.3f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)
    return f"{text} {unit}".rstrip()


def address(place: Placement) -> tuple[str, str]:
    """Protocol address from 0 and 4xxxxx form, each with the bit where there is one."""
    bit = "" if place.bit is None else f".{place.bit}"
    return f"{place.address}{bit}", place.area.notation(place.address) + bit


def describe(event: Event, definition: CellDefinition, more: int = 0) -> str:
    """The event in one sentence: `hmi wrote part_number = 7: refused, held by plc`.

    `more` events befell further variables or locks at the same moment: `plc took start and 3 more`.
    """
    variable = definition.variables[event.variable] if event.variable is not None else None
    others = f" and {more} more" if more else ""
    name = variable.name + others if variable is not None else ""
    unit = variable.unit if variable is not None else ""
    writer = definition.writer_name(event.writer) if event.writer is not None else "a stranger"
    other = definition.writer_name(event.other) if event.other is not None else "nobody"
    lock = definition.locks[event.lock].name + others if event.lock is not None else ""
    new = number(event.new, unit) if event.new is not None else "?"
    match event.kind:
        case EventKind.REFUSED:
            value = f" = {new}" if event.new is not None else ""
            why = f"held by {other}" if event.other is not None else event.reason and event.reason.text
            times = f" ({event.repeats + 1} times)" if event.repeats else ""
            return f"{writer} wrote {name or 'an address without a variable'}{value}: refused, {why}{times}"
        case EventKind.FALLBACK:
            return f"{name} fell back" + ("" if more else f" to {new}")
        case EventKind.ACQUIRED:
            return f"{writer} took {lock}"
        case EventKind.TAKEN_OVER:
            return f"{writer} took {lock} over from {other}"
        case EventKind.RELEASED:
            return f"{lock} {'are' if more else 'is'} free: {event.detail}"
        case EventKind.WRITER_CONNECTED | EventKind.WRITER_LOST:
            return f"{event.kind.value.replace('writer', writer)}: {event.detail}"
        case EventKind.FORCED:
            return f"{name} forced to {new} by the local operator"
        case EventKind.UNFORCED:
            return f"{name} no longer forced: {event.detail}"
        case _:
            about = f" {name}" if name else ""
            return f"{event.kind.value}{about}" + (f": {event.detail}" if event.detail else "")
