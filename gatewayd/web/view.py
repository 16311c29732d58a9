"""The JSON view of the cells that the page polls: what a mapping fixes once (`layout`), what changes always (`state`).

Columns instead of objects per variable: a poll of a full image is a few kilobytes and well under a millisecond.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterable
from itertools import groupby, islice
from typing import Any

from gatewayd.control.views import robot_name
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Fallback, Lock, Variable
from gatewayd.core.events import Event, EventKind
from gatewayd.core.image import Quality
from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.links.contract import SourceLink
from gatewayd.links.modbus_server.plan import Placement, modbus_of
from gatewayd.links.robot.plan import robot_of
from gatewayd.report.event_text import Happening
from gatewayd.report.format import address
from gatewayd.report.printable import json_text
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.service.daemon import Daemon
from gatewayd.web import picture
from gatewayd.web.picture import Level, Node
from gatewayd.web.probes import Probes

__all__ = ["EVENTS", "as_json", "layout", "overview", "state"]

EVENTS = 100
"""Events told at most in one answer; those of one deed, as many variables as it may concern, are one."""

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
"""Kinds of events that befall many variables in one moment."""


def as_json(document: object) -> bytes:
    """Strict JSON in UTF-8: numbers that JSON does not know become the texts `NaN`, `Infinity`, `-Infinity`."""
    try:
        text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    except ValueError:
        text = json.dumps(_finite(document), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return json_text(text).encode()


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return "NaN" if value != value else "Infinity" if value > 0 else "-Infinity"  # noqa: PLR0124
    return value


def overview(daemon: Daemon, version: str) -> dict[str, object]:
    """Every cell that is served, by name."""
    return {
        "gatewayd": version,
        "cells": [{"name": cell.definition.name, "fingerprint": _fingerprint(cell)} for cell in daemon.cells],
    }


def layout(runtime: CellRuntime) -> dict[str, object]:
    """What the mapping fixes. It is the same as long as the fingerprint is."""
    definition, modbus = runtime.cell.definition, modbus_of(runtime.plan)
    places: dict[int, list[dict[str, object]]] = {}
    for one in modbus.placements if modbus is not None else ():
        places.setdefault(one.variable, []).append(_place(one))
    for index, place in _objects(runtime).items():
        places.setdefault(index, []).append(place)
    return {
        "cell": definition.name,
        "fingerprint": _fingerprint(runtime.cell),
        "robot": f"{robot_of(runtime.plan).host}:{robot_of(runtime.plan).port}",
        "modbus": None
        if modbus is None
        else {"listen": address(modbus.host, modbus.port), "unit": modbus.unit},
        "writers": [{"name": one.name, "timeout": one.timeout} for one in definition.writers],
        "locks": [_lock(one, runtime.cell) for one in definition.locks],
        "variables": [
            _variable(one, places.get(index, ())) for index, one in enumerate(definition.variables)
        ],
    }


def _lock(lock: Lock, cell: Cell) -> dict[str, object]:
    definition = cell.definition
    return {
        "name": lock.name,
        "owners": [definition.writers[one].name for one in lock.owners],
        "takeover": lock.takeover,
        "lease": lock.lease,
        "variables": [definition.variables[one].name for one in lock.members],
    }


def _variable(variable: Variable, places: Iterable[dict[str, object]]) -> dict[str, object]:
    limits = variable.limits
    is_input = variable.direction is Direction.INPUT
    return {
        "number": variable.number,
        "name": variable.name,
        "direction": variable.direction.value,
        "kind": variable.kind.name.lower(),
        "robot": robot_name(variable),
        "places": list(places),
        "lock": variable.lock,
        "limits": None if limits is None else [limits.low, limits.high],
        "fallback": _fallback(variable.on_release if is_input else variable.on_stale),
        "unit": variable.unit,
        "comment": variable.comment,
    }


def _place(place: Placement) -> dict[str, object]:
    """Protocol address from 0 and 4xxxxx form, each with the bit where there is one."""
    bit = "" if place.bit is None else f".{place.bit}"
    return {
        "area": place.area.name.lower(),
        "address": f"{place.address}{bit}",
        "notation": place.area.notation(place.address) + bit,
        "type": "bit" if place.codec is None else f"{place.codec.type} {place.codec.order}".strip(),
    }


def _objects(runtime: CellRuntime) -> dict[int, dict[str, object]]:
    """The CANopen side, in the form of a Modbus place: object, and COB-ID of the PDO that carries it."""
    canopen = canopen_of(runtime.plan)
    if canopen is None:
        return {}
    cob_ids = {entry.variable: f"COB-ID 0x{pdo.cob_id:03X}" for pdo in canopen.pdos for entry in pdo.entries}
    return {
        one.variable: {
            "area": "object",
            "address": f"{one.index:04X}h:{one.subindex:02X}",
            "notation": cob_ids.get(one.variable, "by SDO"),
            "type": one.type.name,
        }
        for one in canopen.objects
    }


def _fallback(fallback: Fallback) -> str:
    return fallback.kind.value if fallback.value is None else json.dumps(fallback.value)


def state(runtime: CellRuntime, probes: Probes, since: int, now: float) -> dict[str, object]:
    """What there is at one moment; of the events those after the first `since`."""
    cell = runtime.cell
    image, ownership, health = cell.image, cell.ownership, cell.health
    nodes = _picture(runtime, probes, now)
    owned = [
        [lock, owner, _milliseconds(ownership.remaining(lock, now))]
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
        "accepted": health.writes_accepted,
        "refused": health.writes_refused,
        "events": {"count": cell.events.count, "latest": _events(cell, since, now)},
    }


def _number(value: float) -> float:
    """Six digits after the point are more than anybody reads, and half of what a float would take."""
    return round(value, 6) if type(value) is float else value


def _ages(cell: Cell, now: float) -> list[int | None]:
    """Milliseconds since the source told each value; None: never."""
    image = cell.image
    shared = _milliseconds(now - image.output_time)
    outputs = {index for index in image.outputs if not image.variables[index].valid_running}
    told = (Quality.GOOD, Quality.STALE)
    return [
        shared if index in outputs and quality in told else _milliseconds(image.age(index, now))
        for index, quality in enumerate(image.quality)
    ]


def _milliseconds(seconds: float) -> int | None:
    return int(max(0.0, seconds) * 1000) if seconds < math.inf else None


def _events(cell: Cell, since: int, now: float) -> list[dict[str, object]]:
    ring = cell.events
    new = min(ring.count - since if 0 <= since <= ring.count else ring.count, len(ring))
    wall = time.time() - now
    latest = islice(enumerate(ring, ring.count - len(ring) + 1), len(ring) - new, None)
    runs = [list(run) for _, run in groupby(latest, _deed)]
    return [
        _event(run[0][1], cell, run[-1][0], wall + run[0][1].time, len(run) - 1) for run in runs[-EVENTS:]
    ]


def _deed(numbered: tuple[int, Event]) -> tuple[object, ...]:
    """What events that are one deed have in common: a lost PLC must not vanish below its hundred fallbacks."""
    number, event = numbered
    one = number if event.kind not in _IN_RUNS else None
    return event.kind, event.time, event.writer, event.other, event.detail, one


def _event(event: Event, cell: Cell, number: int, at: float, more: int) -> dict[str, object]:
    told = Happening.of(event, cell.definition).of_several(more)
    return {
        "number": number,
        "time": round(at, 3),
        "kind": told.what,
        "bad": told.bad,
        "text": told.sentence(),
        "variable": event.variable,
    }


def _picture(runtime: CellRuntime, probes: Probes, now: float) -> dict[str, object]:
    cell = runtime.cell
    source = runtime.source.health()
    robot = picture.robot(cell, str(source.figures["address"]), "; ".join(source.problems), now)
    gateway = picture.gateway(cell, probes.late, probes.troubles(), now)
    buses = [
        picture.link(link.health()) for link in runtime.links.values() if not isinstance(link, SourceLink)
    ]
    writers = picture.writers(cell, now)
    levels = [one.level for one in (robot, gateway, *buses, *writers) if one.level is not Level.IDLE]
    return {
        "level": max(levels).name.lower(),
        "robot": _node(robot),
        "gateway": _node(gateway),
        "buses": list(map(_node, buses)),
        "writers": list(map(_node, writers)),
    }


def _node(node: Node) -> dict[str, object]:
    return {"name": node.name, "level": node.level.name.lower(), "words": node.words, "facts": node.facts}


def _fingerprint(cell: Cell) -> str:
    return f"{cell.definition.fingerprint:08X}"
