"""The cell as a picture: robot, gateway, buses and writers, each green, yellow or red with the reason in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from gatewayd.core.cell import Cell
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.links.contract import LinkHealth
from gatewayd.report.format import counted, span
from gatewayd.web.health import SOURCES

__all__ = ["RECENT", "Level", "Node", "gateway", "link", "robot", "writers"]

RECENT = 10.0
"""Seconds for which a refusal or a differing read-back colours the picture."""


class Level(IntEnum):
    """How a part of the picture is; the page shows a colour and a word for it."""

    GOOD = 0
    WARN = 1
    BAD = 2
    IDLE = 3
    """Not there, and not missed yet."""


@dataclass(frozen=True, slots=True)
class Node:
    """One part of the picture."""

    name: str
    level: Level
    words: str
    """Why it has this level."""
    facts: str = ""
    """Key figures, where there are any."""


def robot(cell: Cell, address: str, trouble: str, now: float) -> Node:
    """The controller; `trouble` is why it cannot be reached, if that is known."""
    health, state = cell.health, cell.freshness.state
    facts = (
        f"{health.frequency:.0f} packages/s, {health.skipped} skipped" if state is Source.FRESH else address
    )
    if state is Source.LOST:
        return Node("Robot", Level.BAD, _lost(cell, address, trouble, now), facts)
    if state is not Source.FRESH:
        level = Level.WARN if state is Source.WAITING else Level.BAD
        age = now - cell.freshness.last_progress
        since = f", last news {span(age)} ago" if age < math.inf else ""
        return Node("Robot", level, SOURCES[state].removeprefix("robot ") + since, facts)
    missing = cell.image.available.count(False)
    if not cell.accepts_writes:
        return Node("Robot", Level.WARN, "fresh, its inputs are not adopted yet", facts)
    if health.differing:
        words = f"fresh, but it holds something else for {counted(health.differing, 'input')}"
        return Node("Robot", Level.BAD, words, facts)
    if health.unadopted:
        words = f"fresh, but what it holds is not known for {counted(health.unadopted, 'input')}"
        return Node("Robot", Level.WARN, words, facts)
    if missing:
        return Node("Robot", Level.WARN, f"fresh, but {counted(missing, 'variable')} unavailable", facts)
    return Node("Robot", Level.GOOD, "fresh and writable", facts)


def _lost(cell: Cell, address: str, trouble: str, now: float) -> str:
    trouble = trouble.removeprefix(f"{address}: ")
    last = next((event for event in reversed(list(cell.events)) if event.kind is EventKind.ROBOT_LOST), None)
    if last is None:
        return f"not connected: {trouble}" if trouble else "not connected yet"
    return f"lost {span(now - last.time)} ago: {trouble or last.detail.removeprefix(f'{address}: ')}"


def gateway(cell: Cell, hanging: Sequence[str], troubles: Sequence[str], now: float) -> Node:
    """The gateway itself, as far as this cell is concerned."""
    forced = cell.image.quality.count(Quality.FORCED)
    good = cell.image.quality.count(Quality.GOOD)
    facts = f"{good} of {len(cell.image.quality)} values good"
    if hanging:
        return Node("Gateway", Level.BAD, f"hangs: {', '.join(hanging)}", facts)
    health, differs = cell.health, _recent(cell, EventKind.READ_BACK_DIFFERS, now)
    if differs:
        return Node("Gateway", Level.WARN, f"read-back differs: {differs}", facts)
    if health.adoption:
        words = f"adopted values without an owner fall back in {span(health.adoption)}"
        return Node("Gateway", Level.WARN, words, facts)
    out_of_range = cell.image.quality.count(Quality.OUT_OF_RANGE)
    if out_of_range:
        words = f"{counted(out_of_range, 'value')} out of the range of a place"
        return Node("Gateway", Level.WARN, words, facts)
    if forced:
        return Node("Gateway", Level.WARN, f"{counted(forced, 'value')} forced by the local operator", facts)
    if troubles:
        return Node("Gateway", Level.WARN, "; ".join(troubles), facts)
    return Node("Gateway", Level.GOOD, "running", facts)


def _recent(cell: Cell, kind: EventKind, now: float) -> str:
    for event in reversed(list(cell.events)):
        if now - event.time > RECENT:
            return ""
        if event.kind is kind:
            return event.detail
    return ""


def link(health: LinkHealth) -> Node:
    """A link other than the robot's."""
    return Node(health.name, Level[health.level.name], health.words, health.detail)


def writers(cell: Cell, now: float) -> list[Node]:
    """Who may write."""
    return [_writer(cell, index, now) for index in range(len(cell.definition.writers))]


def _writer(cell: Cell, index: int, now: float) -> Node:
    name = cell.definition.writers[index].name
    held = len(cell.ownership.held_by(index))
    facts = f"holds {counted(held, 'lock')}" if held else "holds no lock"
    last = cell.last_refusal
    if last is not None and last.writer == index and now - last.time <= RECENT:
        refusal = last.refusal
        what = f" {cell.definition.variables[refusal.variable].name}" if refusal.variable is not None else ""
        why = refusal.reason.text
        if refusal.holder is not None:
            why = f"held by {cell.definition.writer_name(refusal.holder)}"
        return Node(name, Level.WARN, f"refused{what}: {why}", facts)
    if cell.writers.alive[index]:
        return Node(name, Level.GOOD, "connected", facts)
    silent = now - cell.writers.last_seen[index]
    if silent == math.inf:
        return Node(name, Level.IDLE, "has not come yet", facts)
    return Node(name, Level.BAD, f"lost, last heard {span(silent)} ago", facts)
