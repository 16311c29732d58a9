"""Cells as plain values for JSON: what `gatewayd.control.documented` promises, at one moment.

Pure: the time is a parameter. `wall` is what the wall clock shows at monotonic time `now`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any, Protocol

from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR, Direction, Fallback, FallbackKind, Variable
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.health import CAN_BUS, NMT_STATES
from gatewayd.core.image import Quality
from gatewayd.links.canopen_node.plan import canopen_of
from gatewayd.links.contract import Link
from gatewayd.links.modbus_server.plan import Placement, modbus_of
from gatewayd.links.robot.plan import robot_of
from gatewayd.mapping.plan import Plan
from gatewayd.report.event_text import Happening
from gatewayd.report.format import counted, span
from gatewayd.service.audit import Record, plain_value, utc

__all__ = [
    "Json",
    "RuntimeView",
    "cell_view",
    "declared_view",
    "event_view",
    "lock_view",
    "problems",
    "record_view",
    "robot_name",
    "variable_view",
]

Json = dict[str, Any]

_QUALITIES = tuple(one.name.lower() for one in Quality)
_BIT_WORD = re.compile(r"(input|output)_bit_registers(\d+)_to_\d+")


class RuntimeView(Protocol):
    """One cell as the daemon serves it."""

    @property
    def plan(self) -> Plan:
        """Its mapping."""

    @property
    def cell(self) -> Cell:
        """Its state."""

    @property
    def source(self) -> Link:
        """The link that values come from."""


def cell_view(runtime: RuntimeView, now: float) -> Json:
    """One cell of the status."""
    plan, cell = runtime.plan, runtime.cell
    health, definition, quality = cell.health, cell.definition, cell.image.quality
    owners = cell.ownership.owners
    modbus, canopen = modbus_of(plan), canopen_of(plan)
    found = problems(cell, now, "; ".join(runtime.source.health().problems))
    return {
        "name": definition.name,
        "source": plan.source,
        "fingerprint": f"{definition.fingerprint:08X}",
        "healthy": not found,
        "problems": found,
        "robot": _robot(plan, cell, now),
        "modbus": None
        if modbus is None
        else {
            "listen": _address(modbus.host, modbus.port),
            "unit": modbus.unit,
            "connections": health.modbus_connections,
        },
        "canopen": None
        if canopen is None
        else {
            "channel": f"{canopen.interface}:{canopen.channel}",
            "node": canopen.node,
            "bus": CAN_BUS[health.can_bus],
            "nmt_state": NMT_STATES.get(health.nmt_state, str(health.nmt_state)),
        },
        "writers": [_writer(cell, index, now) for index in range(len(definition.writers))],
        "variables": {"total": len(quality)} | {one.name.lower(): quality.count(one) for one in Quality},
        "locks": {
            "total": len(owners),
            "owned": len(owners) - owners.count(None),
            "operator": owners.count(OPERATOR),
        },
        "writes": {"accepted": health.writes_accepted, "refused": health.writes_refused},
        "last_refusal": _last_refusal(cell, now),
        "heartbeat": health.heartbeat,
        "gaps": health.gaps,
    }


def problems(cell: Cell, now: float, no_robot: str = "") -> list[str]:
    """What keeps a cell from being healthy, each in words that a maintenance crew understands.

    `no_robot` is why there is no session with the controller, if that is known: cause and remedy.

    A writer that has not come yet is no problem: nobody knows whether it should be there. One that was there is.
    """
    found = []
    state = cell.freshness.state
    if state is not Source.FRESH:
        why = f": {no_robot}" if state is Source.LOST and no_robot else ""
        found.append(_SOURCES[state] + _since(now - cell.freshness.last_progress) + why)
    elif not cell.accepts_writes:
        found.append("the robot's inputs are not adopted yet, nothing can be written")
    if cell.health.can_trouble:
        found.append(f"CAN bus {cell.health.can_trouble}")
    found += _not_good(cell)
    if cell.forcing.forces:
        names = sorted(cell.definition.variables[index].name for index in cell.forcing.forces)
        found.append(f"forced by the local operator: {_list(names)}")
    held = cell.ownership.held_by(OPERATOR)
    if held:
        names = [cell.definition.locks[lock].name for lock in held]
        found.append(f"locks held by the local operator: {_list(names)}")
    for index, writer in enumerate(cell.definition.writers):
        seen = cell.writers.last_seen[index]
        if not cell.writers.alive[index] and seen > -math.inf:
            found.append(f"writer {writer.name} lost{_since(now - seen)}")
    return found


def _not_good(cell: Cell) -> Iterator[str]:
    """What is wrong with single variables."""
    quality = cell.image.quality
    unread = [cell.definition.variables[index].name for index in sorted(cell.delivery.unread)]
    if unread:
        yield f"what the robot holds is not known for {counted(len(unread), 'input')}: {_list(unread)}"
    for its, words in _NOT_GOOD.items():
        count = quality.count(its)
        if count:
            yield f"{count} of {len(quality)} variables {words}: {_some(cell, its)}"


def declared_view(plan: Plan) -> tuple[Json, ...]:
    """What the mapping says of each variable: the part of its view that does not change."""
    places: dict[int, list[Json]] = {}
    modbus = modbus_of(plan)
    for one in modbus.placements if modbus is not None else ():
        places.setdefault(one.variable, []).append(_place(one))
    objects = _objects(plan)
    return tuple(
        {
            "cell": plan.cell.name,
            "number": variable.number,
            "name": variable.name,
            "direction": variable.direction.value,
            "kind": variable.kind.name.lower(),
            "robot": robot_name(variable),
            "modbus": places.get(index, []),
            "canopen": objects.get(index),
            "unit": variable.unit,
            "lock": plan.cell.locks[variable.lock].name if variable.lock is not None else None,
            "limits": None if variable.limits is None else [variable.limits.low, variable.limits.high],
            "fallback": _fallback(
                variable.on_release if variable.direction is Direction.INPUT else variable.on_stale
            ),
            "comment": variable.comment,
        }
        for index, variable in enumerate(plan.cell.variables)
    )


def variable_view(declared: Json, cell: Cell, index: int, now: float) -> Json:
    """One variable: what is `declared` of it, and how it is now."""
    lock = cell.definition.variables[index].lock
    owner = cell.ownership.owners[lock] if lock is not None else None
    force = cell.forcing.forces.get(index)
    return {
        **declared,
        "value": plain_value(cell.image.values[index]),
        "quality": _QUALITIES[cell.image.quality[index]],
        "age": _seconds(cell.image.age(index, now)),
        "owner": None if owner is None else cell.definition.writer_name(owner),
        "lease": None if lock is None or owner is None else _seconds(cell.ownership.remaining(lock, now)),
        "forced": None
        if force is None
        else {"value": plain_value(force.value), "remaining": _seconds(force.until - now)},
    }


def lock_view(cell: Cell, index: int, now: float) -> Json:
    """One lock."""
    definition, lock = cell.definition, cell.definition.locks[index]
    owner = cell.ownership.owners[index]
    return {
        "cell": definition.name,
        "name": lock.name,
        "members": [definition.variables[member].name for member in lock.members],
        "owners": [definition.writers[writer].name for writer in lock.owners],
        "takeover": lock.takeover,
        "declared_lease": lock.lease,
        "owner": None if owner is None else definition.writer_name(owner),
        "remaining": None if owner is None else _seconds(cell.ownership.remaining(index, now)),
    }


def event_view(cell: Cell, seq: int, event: Event, now: float, wall: float) -> Json:
    """One event; what does not apply is left out."""
    told = Happening.of(event, cell.definition)
    found: Json = {
        "seq": seq,
        "time": utc(wall - (now - event.time)),
        "cell": cell.definition.name,
        "event": told.what,
        "variable": told.variable,
        "lock": told.lock,
        "writer": told.writer,
        "other": told.holder,
        "reason": told.reason,
        "peer": told.peer,
        "old": plain_value(told.old),
        "new": plain_value(told.new),
        "repeats": event.repeats or None,
        "detail": told.detail or None,
        "text": told.sentence(),
        "bad": told.bad,
    }
    return {field: value for field, value in found.items() if value is not None}


def record_view(record: Record) -> Json:
    """One record of the audit, as its file has it, and in words."""
    told = record.happening
    return {**record.as_json(), "text": told.sentence(), "bad": told.bad}


def robot_name(variable: Variable) -> str:
    """What the variable is in the robot, as the mapping file names it."""
    word = _BIT_WORD.fullmatch(variable.field)
    if word is not None and variable.bit is not None:
        return f"{word[1]}_bit_register_{int(word[2]) + variable.bit}"
    element = "" if variable.element is None else f"[{variable.element}]"
    return f"{variable.field}{element}" + ("" if variable.bit is None else f".{variable.bit}")


_SOURCES = {
    Source.LOST: "robot not connected",
    Source.WAITING: "robot connected, but it sends no data yet",
    Source.SILENT: "robot silent",
    Source.FROZEN: "robot frozen, its clock stands still",
    Source.LATE: "robot values come too late",
}
_NOT_GOOD = {
    Quality.UNAVAILABLE: "unavailable",
    Quality.DIFFERS: "different in the robot",
    Quality.OUT_OF_RANGE: "with a value that a register or object cannot show",
}
"""Qualities of single variables that somebody should look at."""
_LISTED = 3
"""Names told one by one."""


def _robot(plan: Plan, cell: Cell, now: float) -> Json:
    health = cell.health
    return {
        "address": _address(robot_of(plan).host, robot_of(plan).port),
        "state": cell.freshness.state.name.lower(),
        "writable": cell.accepts_writes,
        "age": _seconds(now - cell.freshness.last_progress),
        "frequency": round(health.frequency, 1),
        "packages": health.packages,
        "skipped": health.skipped,
        "late": health.late,
        "sessions": health.sessions,
        "mismatches": health.read_back_mismatches,
        "lag": round(health.lag, 3),
        "unadopted": health.unadopted,
        "differing": health.differing,
        "adoption": _seconds(health.adoption),
        "watchdog": None if robot_of(plan).watchdog is None else health.watchdog_fed,
    }


def _writer(cell: Cell, index: int, now: float) -> Json:
    writer, table = cell.definition.writers[index], cell.writers
    return {
        "name": writer.name,
        "alive": table.alive[index],
        "connections": table.connections[index],
        "age": _seconds(now - table.last_seen[index]),
        "timeout": writer.timeout,
        "locks": len(cell.ownership.held_by(index)),
    }


def _last_refusal(cell: Cell, now: float) -> Json | None:
    last = cell.last_refusal
    if last is None:
        return None
    refusal, writer = last.refusal, last.writer
    told = Happening.of(
        Event(
            last.time,
            EventKind.REFUSED,
            refusal.variable,
            writer=writer,
            other=refusal.holder,
            reason=refusal.reason,
            peer=last.peer,
        ),
        cell.definition,
    )
    return {
        "variable": told.variable,
        "writer": None if writer is None else told.writer,
        "holder": told.holder,
        "reason": told.reason,
        "age": _seconds(now - last.time),
        "text": told.sentence(),
    }


def _place(placement: Placement) -> Json:
    notation = placement.area.notation(placement.address)
    return {
        "area": placement.area.name.lower(),
        "address": placement.address,
        "bit": placement.bit,
        "notation": notation if placement.bit is None else f"{notation}.{placement.bit}",
    }


def _fallback(fallback: Fallback) -> object:
    return plain_value(fallback.value) if fallback.kind is FallbackKind.VALUE else fallback.kind.value


def _objects(plan: Plan) -> dict[int, Json]:
    """Where each variable lies in the object dictionary, and the COB-ID of the PDO that carries it, by index."""
    canopen = canopen_of(plan)
    if canopen is None:
        return {}
    cob_ids = {entry.variable: pdo.cob_id for pdo in canopen.pdos for entry in pdo.entries}
    return {
        one.variable: {
            "object": f"{one.index:04X}h:{one.subindex:02X}",
            "type": one.type.name,
            "cob_id": cob_ids.get(one.variable),
        }
        for one in canopen.objects
    }


def _address(host: str, port: int) -> str:
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def _seconds(seconds: float) -> float | None:
    """To the millisecond; None for never and for no end."""
    return round(max(0.0, seconds), 3) if math.isfinite(seconds) else None


def _since(seconds: float) -> str:
    return f" for {span(seconds)}" if math.isfinite(seconds) else ""


def _some(cell: Cell, quality: Quality) -> str:
    return _list(
        [
            one.name
            for one, its in zip(cell.definition.variables, cell.image.quality, strict=True)
            if its is quality
        ]
    )


def _list(names: list[str]) -> str:
    more = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")
