"""How a cell is: what is wrong with it is decided here, once, and worded here, once.

Log, STATUS of the service manager, commands, control interface, page, /readyz, metrics and demonstration show this.
Pure: a cell, what its links say of themselves, and the time in; levels and texts out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.links.contract import Level, Link, LinkHealth, SourceLink
from gatewayd.mapping.plan import Plan
from gatewayd.report.format import counted, listed, span, verb
from gatewayd.report.words import SOURCE_LEVELS, SOURCES

RECENT = 10.0
"""Seconds for which a part tells of a refusal or a read-back that differed."""
PRESENT = 3.0
"""Seconds for which it colours its part: what is over must not outshine how things are."""
_LISTED = 3
"""Names listed by name."""


@dataclass(frozen=True, slots=True)
class PicturePart:
    """One part of the picture: the robot, the gateway, another link, a writer."""

    name: str
    level: Level
    words: str
    """Why it has this level."""
    detail: str = ""
    """Key figures, where there are any."""


@dataclass(frozen=True, slots=True)
class CellVerdict:
    """How a cell is at one moment."""

    problems: tuple[str, ...]
    """What keeps it from being healthy, each in words that a maintenance crew understands."""
    unserved: tuple[str, ...]
    """Those of them for which it is not served: its values are not fresh, or nothing can be written."""
    robot: PicturePart
    gateway: PicturePart
    """As far as this cell is concerned; `gateway_part` adds what concerns all."""
    links: Mapping[str, PicturePart]
    """All links but the robot's, by name."""
    writers: tuple[PicturePart, ...]

    @property
    def healthy(self) -> bool:
        """Whether there is no problem."""
        return not self.problems

    @property
    def level(self) -> Level:
        """That of the worst part."""
        return self.worst.level

    @property
    def worst(self) -> PicturePart:
        """The part to look at first: of those with the worst level, the nearest to the robot."""
        parts = (self.robot, self.gateway, *self.links.values(), *self.writers)
        return max(parts, key=lambda part: part.level)


@dataclass(frozen=True, slots=True)
class _Finding:
    level: Level
    text: str
    passing: bool = False
    """It goes by itself, and is no problem; GOOD: it is over."""


class ServedCell(Protocol):
    """A cell as the daemon serves it, with its links."""

    @property
    def plan(self) -> Plan:
        """Its mapping."""

    @property
    def cell(self) -> Cell:
        """Its state."""

    @property
    def source(self) -> SourceLink:
        """The link that its values come from."""

    @property
    def links(self) -> Mapping[str, Link]:
        """All links, by name."""


def verdict_of(served: ServedCell, now: float) -> CellVerdict:
    """The verdict on a cell that is served."""
    others = {name: link.health() for name, link in served.links.items() if link is not served.source}
    return judge(served.cell, served.source.health(), others, now)


def judge(cell: Cell, source: LinkHealth, links: Mapping[str, LinkHealth], now: float) -> CellVerdict:
    """The verdict on a cell, its robot link (`source`: the problems are the cause of a loss) and its other links."""
    writers = range(len(cell.writers.alive))
    unserved, held = (
        list(_unserved(cell, source, now)),
        [*_held_by_robot(cell), *_reported_by_source(cell, source)],
    )
    of_gateway = list(_of_gateway(cell, now))
    lost = {index: finding for index in writers for finding in _lost(cell, index, now)}
    return CellVerdict(
        problems=(
            *(finding.text for finding in unserved),
            *(problem for health in links.values() for problem in health.problems),
            *(finding.text for finding in (*held, *of_gateway, *lost.values()) if not finding.passing),
        ),
        unserved=tuple(finding.text for finding in unserved),
        robot=_part(
            "Robot",
            [*unserved, *held],
            "read only" if cell.standing_by else "fresh and writable",
            _rate(cell, source),
        ),
        gateway=_part("Gateway", of_gateway, cell.standing_by or "running", _good(cell)),
        links={
            name: PicturePart(health.name, health.level, health.words, health.detail)
            for name, health in links.items()
        },
        writers=tuple(_writer(cell, index, lost.get(index), now) for index in writers),
    )


def gateway_part(verdict: CellVerdict, hanging: Sequence[str], troubles: Sequence[str]) -> PicturePart:
    """The gateway with what concerns all cells: parts of it that hang, and standing troubles."""
    part = verdict.gateway
    found = [_Finding(Level.BAD, f"hangs: {', '.join(hanging)}")] if hanging else []
    if part.level is not Level.GOOD:
        found.append(_Finding(part.level, part.words))
    found += [_Finding(Level.WARN, trouble) for trouble in troubles if trouble]
    return _part(part.name, found, part.words, part.detail)


def _part(name: str, findings: Sequence[_Finding], well: str, detail: str) -> PicturePart:
    """The part with its findings, the worst first; without any, or with what is over alone, it is `well`."""
    ordered = sorted((*findings, _Finding(Level.GOOD, well)), key=lambda finding: -finding.level)
    level = ordered[0].level
    if level is Level.GOOD:
        ordered.insert(0, ordered.pop())
    else:
        ordered.pop()
    return PicturePart(name, level, "; ".join(finding.text for finding in ordered), detail)


# -- the robot ---------------------------------------------------------------------------------------------------


def _unserved(cell: Cell, source: LinkHealth, now: float) -> Iterator[_Finding]:
    state = cell.freshness.state
    if state is not Source.FRESH:
        why = f": {'; '.join(source.problems)}" if state is Source.LOST and source.problems else ""
        since = _since(now - cell.freshness.last_progress)
        yield _Finding(SOURCE_LEVELS[state], f"robot {SOURCES[state]}{since}{why}")
    elif not cell.accepts_writes and not cell.standing_by:
        yield _Finding(Level.WARN, "the robot's inputs are not adopted yet, nothing can be written")


def _held_by_robot(cell: Cell) -> Iterator[_Finding]:
    """What it does not report, or has not as it was given."""
    unread = [cell.definition.variables[index].name for index in sorted(cell.delivery.unread)]
    if unread:
        text = f"what the robot holds is not known for {counted(len(unread), 'input')}: {listed(unread, _LISTED)}"
        yield _Finding(Level.WARN, text)
    yield from _with_quality(cell, Quality.UNAVAILABLE, Level.WARN, "unavailable")
    yield from _with_quality(cell, Quality.DIFFERS, Level.BAD, "different in the robot")


def _reported_by_source(cell: Cell, source: LinkHealth) -> Iterator[_Finding]:
    """Why something is as it is, as far as the link knows; the causes of a loss are said with it."""
    if cell.freshness.state is not Source.LOST:
        yield from (_Finding(Level.WARN, problem) for problem in source.problems)


def _rate(cell: Cell, source: LinkHealth) -> str:
    if cell.freshness.state is Source.FRESH:
        return f"{cell.health.frequency:.0f} packages/s, {cell.health.skipped} skipped"
    return str(source.figures.get("address", ""))


# -- the gateway -------------------------------------------------------------------------------------------------


def _of_gateway(cell: Cell, now: float) -> Iterator[_Finding]:
    words = "with a value that a register or object cannot show"
    yield from _with_quality(cell, Quality.OUT_OF_RANGE, Level.WARN, words)
    if cell.forcing.forces:
        names = sorted(cell.definition.variables[index].name for index in cell.forcing.forces)
        yield _Finding(Level.WARN, f"forced by the local operator: {listed(names, _LISTED)}")
    held = cell.ownership.held_by(OPERATOR)
    if held:
        names = [cell.definition.locks[lock].name for lock in held]
        yield _Finding(
            Level.WARN, f"{counted(len(names), 'lock')} held by the local operator: {listed(names, _LISTED)}"
        )
    differed = cell.events.latest.get(EventKind.READ_BACK_DIFFERS)
    if differed is not None and now - differed.time <= RECENT and differed.detail:
        level, ago = _past(now - differed.time)
        yield _Finding(level, f"read-back differed {ago}: {differed.detail}", passing=True)
    if cell.health.adoption:
        left = span(cell.health.adoption)
        yield _Finding(Level.WARN, f"adopted values without an owner fall back in {left}", passing=True)


def _good(cell: Cell) -> str:
    quality = cell.image.quality
    if not quality:
        return "no values"
    return f"{quality.count(Quality.GOOD)} of {counted(len(quality), 'value')} good"


def _past(duration: float) -> tuple[Level, str]:
    """How what happened so long ago colours its part, and when that was, in words."""
    level = Level.WARN if duration <= PRESENT else Level.GOOD
    return level, f"{span(duration)} ago" if duration >= 1 else "just now"


# -- writers -----------------------------------------------------------------------------------------------------


def _lost(cell: Cell, index: int, now: float) -> Iterator[_Finding]:
    """A writer that has not come yet is no problem: nobody knows whether it should be there. One that was there is."""
    seen = cell.writers.last_seen[index]
    if not cell.writers.alive[index] and seen > -math.inf:
        name = cell.definition.writers[index].name
        yield _Finding(Level.BAD, f"writer {name} lost{_since(now - seen)}")


def _writer(cell: Cell, index: int, lost: _Finding | None, now: float) -> PicturePart:
    name, held = cell.definition.writers[index].name, len(cell.ownership.held_by(index))
    detail = f"{verb('hold', name)} {counted(held, 'lock') if held else 'no lock'}"
    refused = _refused(cell, index, now)
    if lost is not None:
        return PicturePart(name, lost.level, lost.text, detail)
    alive = cell.writers.alive[index]
    words, level = (
        ("connected", Level.GOOD) if alive else (f"{verb('have', name)} not connected yet", Level.IDLE)
    )
    if refused is not None:
        words, level = f"{words}; {refused.text}", max(level, refused.level)
    return PicturePart(name, level, words, detail)


def _refused(cell: Cell, index: int, now: float) -> _Finding | None:
    last = cell.last_refusal
    if last is None or last.writer != index or now - last.time > RECENT:
        return None
    refusal = last.refusal
    level, ago = _past(now - last.time)
    what = f"{cell.definition.variables[refusal.variable].name} " if refusal.variable is not None else ""
    why = refusal.reason.text
    if refusal.holder is not None:
        why = f"held by {cell.definition.writer_name(refusal.holder)}"
    return _Finding(level, f"{what}refused {ago}: {why}", passing=True)


# -- words -------------------------------------------------------------------------------------------------------


def _with_quality(cell: Cell, quality: Quality, level: Level, words: str) -> Iterator[_Finding]:
    qualities = cell.image.quality
    count = qualities.count(quality)
    if count:
        names = [
            variable.name
            for variable, its in zip(cell.definition.variables, qualities, strict=True)
            if its is quality
        ]
        yield _Finding(
            level, f"{count} of {counted(len(qualities), 'variable')} {words}: {listed(names, _LISTED)}"
        )


def _since(duration: float) -> str:
    return f" for {span(duration)}" if math.isfinite(duration) else ""
