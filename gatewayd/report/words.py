"""States in words and colours: the one table of them, for commands, page and demonstration."""

from __future__ import annotations

from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.links.contract import Level

SOURCES = {
    Source.LOST: "not connected",
    Source.WAITING: "connected, but it sends no data yet",
    Source.FRESH: "fresh",
    Source.SILENT: "silent",
    Source.FROZEN: "frozen, its clock stands still",
    Source.LATE: "values come too late",
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
