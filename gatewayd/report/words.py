"""States in words and colours: the one table of them, for commands, page and demonstration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.links.contract import Level

SOURCES = {
    Source.LOST: "not connected",
    Source.WAITING: "connected, but it sends no data yet",
    Source.FRESH: "fresh",
    Source.SILENT: "silent",
    Source.FROZEN: "frozen, its clock stands still",
    Source.LATE: "values arrive too late",
}
"""The state of the robot; `robot` stands in front where nothing else says so."""
SOURCE_LEVELS = {
    Source.LOST: Level.BAD,
    Source.WAITING: Level.WARN,
    Source.FRESH: Level.GOOD,
    Source.SILENT: Level.BAD,
    Source.FROZEN: Level.BAD,
    Source.LATE: Level.BAD,
}
LEVEL_COLOURS = {Level.IDLE: "dim", Level.GOOD: "green", Level.WARN: "yellow", Level.BAD: "red"}
"""As click and rich name them."""
QUALITY_COLOURS = {
    Quality.GOOD: "green",
    Quality.STALE: "yellow",
    Quality.UNAVAILABLE: "red",
    Quality.NEVER: "dim",
    Quality.FORCED: "magenta",
    Quality.DIFFERS: "red",
    Quality.OUT_OF_RANGE: "yellow",
    Quality.NOT_RUNNING: "yellow",
}


def source(name: str) -> Source:
    """The state that the control interface calls so: `lost`."""
    return Source[name.upper()]


def quality(name: str) -> Quality:
    """The quality that the control interface calls so: `out_of_range`."""
    return Quality[name.upper()]


def meaning(value: object, declared: Mapping[str, Any]) -> str:
    """What a value of the control interface stands for: `running`, `power on, program running`; empty for a mere one.

    `declared`: the variable's `meanings` and `bits`. A bit without words goes by its number, so that it is not missed.
    """
    if not isinstance(value, int):
        return ""
    bits: Mapping[str, str] | None = declared.get("bits")
    if bits is None:
        meanings: Mapping[str, str] = declared.get("meanings") or {}
        return meanings.get(str(int(value)), "")
    present = [bit for bit in range(value.bit_length()) if value >> bit & 1]
    return ", ".join(bits.get(str(bit), f"bit {bit}") for bit in present) or "no bit is 1"
