"""What stands in one record of the audit, and its form for programs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime

from gatewayd.core.definition import Value
from gatewayd.report.event_text import EventRecord

PlainValue = bool | int | float | str | None


@dataclass(frozen=True, slots=True)
class Record:
    """One thing that was done, or refused."""

    wall: float
    """Seconds since 1970, UTC."""
    monotonic: float
    """Seconds of the gateway's own clock, which no time server moves; equal for all changes of one request."""
    cell: str
    event: EventRecord
    """Of merged changes `old` is of the first, `new` and both times are of the last."""

    def as_json(self) -> dict[str, object]:
        """Plain values for JSON; what does not apply is left out."""
        event = self.event
        found: dict[str, object | None] = {
            "time": utc(self.wall),
            "monotonic": round(self.monotonic, 6),
            "cell": self.cell,
            "what": event.what,
            "writer": event.writer,
            "variable": event.variable,
            # A variable's lock goes without saying.
            "lock": event.lock if event.variable is None else None,
            "old": plain_value(event.old),
            "new": plain_value(event.new),
            "times": event.times if event.times > 1 else None,
            "holder": event.holder,
            "reason": event.reason,
            "peer": event.peer,
            "request": event.request or None,
            "detail": event.detail or None,
        }
        return {name: value for name, value in found.items() if value is not None}


def plain_value(value: Value | None) -> PlainValue:
    """The value for JSON, which has no NaN and no infinity: those are the texts `nan`, `inf` and `-inf`."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def utc(wall: float) -> str:
    """`2026-11-22T09:00:00.123Z`."""
    return datetime.fromtimestamp(wall, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
