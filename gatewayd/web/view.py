"""The JSON view of the cells that the page polls: what a mapping fixes once (`layout`), what changes always (`state`).

Columns instead of objects per variable: a poll of a full image is a few kilobytes and well under a millisecond.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Generator
from itertools import groupby, islice
from typing import Any

from gatewayd.control.views import Declared, declare, holders, truth
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Lock
from gatewayd.core.events import CAPACITY, Event, EventKind
from gatewayd.core.image import Quality
from gatewayd.links.registry import kinds
from gatewayd.report.event_text import EventRecord
from gatewayd.report.printable import json_text
from gatewayd.report.verdict import PicturePart, gateway_part, verdict_of
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.web.probes import Probes

EVENTS = 100
"""Events in one answer at most; those of one act, as many variables as it may concern, count as one."""

_IN_RUNS = frozenset(
    {
        EventKind.ACQUIRED,
        EventKind.TAKEN_OVER,
        EventKind.RELEASED,
        EventKind.FALLBACK,
        EventKind.UNAVAILABLE,
        EventKind.AVAILABLE,
        EventKind.ADOPTION_ENDS,
        EventKind.READ_BACK_DIFFERS,
        EventKind.FOLLOWED,
    }
)
"""Kinds of events that happen to many variables in one moment."""
_DECLARED = ("number", "name", "direction", "kind", "robot", "limits", "unit", "comment", "meanings", "bits")
"""What the page has of a variable's declaration as it is."""


def as_json(document: object) -> bytes:
    """Strict JSON in UTF-8: numbers that JSON does not know become the texts `NaN`, `Infinity`, `-Infinity`."""
    try:
        text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    except ValueError:
        text = json.dumps(_finite(document), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return json_text(text).encode()


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if value != value else "Infinity" if value > 0 else "-Infinity"  # noqa: PLR0124
    return value


def overview(probes: Probes, version: str, now: float) -> dict[str, object]:
    """Every cell that is served: its name, how it is, and why."""
    return {
        "gatewayd": version,
        "cells": [_glance(runtime, probes, now) for runtime in probes.daemon.runtimes],
    }


def _glance(runtime: CellRuntime, probes: Probes, now: float) -> dict[str, object]:
    verdict = verdict_of(runtime, now)
    gateway = gateway_part(verdict, probes.late, probes.troubles())
    worst = max((verdict.worst, gateway), key=lambda part: part.level)
    named = worst.name.lower() in worst.words.lower()
    return {
        "name": runtime.cell.definition.name,
        "fingerprint": _fingerprint(runtime.cell),
        "level": worst.level.name.lower(),
        "words": worst.words if named else f"{worst.name}: {worst.words}",
    }


def layout(runtime: CellRuntime) -> dict[str, object]:
    """What the mapping fixes. It is the same as long as the fingerprint is."""
    definition, declared = runtime.cell.definition, declare(runtime.plan)
    links = {
        name: link.fields
        for name, link in declared.links.items()
        if runtime.links[name] is not runtime.source
    }
    return {
        "cell": definition.name,
        "fingerprint": _fingerprint(runtime.cell),
        **{kind.key: None for kind in kinds()},
        **links,
        "robot": next(link.address for name, link in declared.links.items() if name not in links),
        "writers": [{"name": writer.name, "timeout": writer.timeout} for writer in definition.writers],
        "locks": [_lock(lock, runtime.cell) for lock in definition.locks],
        "variables": [_variable(runtime.cell, declared, index) for index in range(len(definition.variables))],
    }


def _lock(lock: Lock, cell: Cell) -> dict[str, object]:
    definition = cell.definition
    return {
        "name": lock.name,
        "owners": [definition.writers[writer].name for writer in lock.owners],
        "takeover": lock.takeover,
        "lease": lock.lease,
        "variables": [definition.variables[member].name for member in lock.members],
    }


def _variable(cell: Cell, declared: Declared, index: int) -> dict[str, object]:
    """As the control interface has it; places of all links in one list, and the lock by its number."""
    found = declared.variables[index]
    fallback = found["fallback"]
    return {
        **{name: found[name] for name in _DECLARED},
        "places": [
            {"link": name, **{key: getattr(place, key) for key in ("area", "address", "notation", "type")}}
            for name, link in declared.links.items()
            for place in link.places.get(index, ())
        ],
        "lock": cell.definition.variables[index].lock,
        "fallback": fallback if isinstance(fallback, str) else json.dumps(fallback),
    }


def state(runtime: CellRuntime, probes: Probes, since: int, now: float) -> dict[str, object]:
    """What there is at one moment; of the events those after the first `since`."""
    cell = runtime.cell
    image, ownership, health = cell.image, cell.ownership, cell.health
    nodes = _picture(runtime, probes, now)
    owned = [
        [lock, owner, _milliseconds(ownership.remaining(lock, now)), holders(cell, lock)]
        for lock, owner in enumerate(ownership.owners)
        if owner is not None
    ]
    return {
        "fingerprint": _fingerprint(cell),
        "time": round(time.time(), 3),
        "uptime": round(max(0.0, now - health.started), 1) if health.started < math.inf else 0,
        "picture": nodes,
        "values": list(map(_number, image.values)),
        "quality": list(map(int, image.quality)),
        "ages": _ages(cell, now),
        "owned": owned,
        "forced": [_forced(runtime, index, now) for index in cell.forcing.forces],
        "accepted": health.writes_accepted,
        "refused": health.writes_refused,
        "events": {"count": cell.events.count, "latest": _events(cell, since, now)},
    }


def past(runtime: CellRuntime, probes: Probes, now: float) -> Generator[None, None, bytes]:
    """The last minute: milliseconds from sample to sample, and samples, the oldest first; one in each step."""
    history = probes.of(runtime.cell).history
    samples = []
    for sample in history.samples:
        age, values = _milliseconds(now - sample.time), list(map(_number, sample.values))
        samples.append(as_json({"age": age, "values": values, "quality": list(sample.quality)}))
        yield
    return b'{"period":%d,"samples":[%b]}' % (round(1000 * history.period), b",".join(samples))


def _forced(runtime: CellRuntime, index: int, now: float) -> list[object]:
    """Variable, milliseconds left, the truth beside it with its quality, and who forces it."""
    value, quality = truth(runtime, index) or (None, None)
    force = runtime.cell.forcing.forces[index]
    shown = None if value is None else _number(value)
    left = _milliseconds(force.until - now)
    return [index, left, shown, None if quality is None else int(quality), force.holder.title]


def _number(value: float) -> float:
    """Six digits after the point are more than anybody reads, and half of what a float would take."""
    return round(value, 6) if type(value) is float else value


def _ages(cell: Cell, now: float) -> list[int | None]:
    """Milliseconds since each value came from its source; None: never."""
    image = cell.image
    shared = _milliseconds(now - image.output_time)
    outputs = {index for index in image.packaged if not image.variables[index].valid_running}
    current = (Quality.GOOD, Quality.STALE)
    return [
        shared if index in outputs and quality in current else _milliseconds(image.age(index, now))
        for index, quality in enumerate(image.quality)
    ]


def _milliseconds(seconds: float) -> int | None:
    return int(max(0.0, seconds) * 1000) if seconds < math.inf else None


def _events(cell: Cell, since: int, now: float) -> list[dict[str, object]]:
    ring = cell.events
    wall = time.time() - now
    latest = ring.since(since if 0 <= since <= ring.count else 0, CAPACITY)
    newest = (list(run) for _, run in groupby(reversed(latest), _act))
    return [
        _event(run[-1][1], cell, run[0][0], wall + run[-1][1].time, len(run) - 1)
        for run in reversed(list(islice(newest, EVENTS)))
    ]


def _act(numbered: tuple[int, Event]) -> tuple[object, ...]:
    """What events of one act have in common: a lost PLC must not vanish below its hundred fallbacks."""
    number, event = numbered
    alone = number if event.kind not in _IN_RUNS else None
    return event.kind, event.time, event.writer, event.other, event.detail, alone


def _event(event: Event, cell: Cell, number: int, at: float, more: int) -> dict[str, object]:
    record = EventRecord.of(event, cell.definition).of_several(more)
    return {
        "number": number,
        "time": round(at, 3),
        "kind": record.what,
        "bad": record.bad,
        "text": record.text(),
        "variable": event.variable,
    }


def _picture(runtime: CellRuntime, probes: Probes, now: float) -> dict[str, object]:
    verdict = verdict_of(runtime, now)
    gateway = gateway_part(verdict, probes.late, probes.troubles())
    return {
        "level": max(verdict.level, gateway.level).name.lower(),
        "robot": _node(verdict.robot),
        "gateway": _node(gateway),
        "buses": list(map(_node, verdict.links.values())),
        "writers": list(map(_node, verdict.writers)),
    }


def _node(part: PicturePart) -> dict[str, object]:
    return {"name": part.name, "level": part.level.name.lower(), "words": part.words, "facts": part.detail}


def _fingerprint(cell: Cell) -> str:
    return f"{cell.definition.fingerprint:08X}"
