"""Cells as plain values for JSON, as `gatewayd.report.schema` describes them, at one moment.

Pure: the time is a parameter. `wall` is what the wall clock shows at monotonic time `now`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

from gatewayd.audit.record import Record, plain_value, utc
from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR, Direction, Fallback, FallbackKind, Value
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.links.contract import Description
from gatewayd.links.registry import kind_of, kinds
from gatewayd.mapping.plan import Plan
from gatewayd.report.event_text import EventRecord
from gatewayd.report.facts import described, robot_name
from gatewayd.report.schema import (
    AuditRecord,
    CellStatus,
    EventMessage,
    Json,
    LinkStatus,
    LockStatus,
    RefusalStatus,
    UnservedStatus,
    VariableDeclaration,
    VariableStatus,
    WriterStatus,
)
from gatewayd.report.verdict import CellVerdict, PicturePart, ServedCell, verdict_of

ForceState = tuple[Value, float, tuple[Value, Quality] | None, str]
"""The forced value, its time left, the `truth` beside it, and who forces it."""
VariableState = tuple[Value, Quality, float, str | None, float | None, ForceState | None]
"""Value, quality and age, the owner and its lease, the force; None: there is none."""
_QUALITIES = tuple(quality.name.lower() for quality in Quality)


@dataclass(frozen=True, slots=True)
class Declared:
    """What the mapping of one cell says: the part of its views that does not change."""

    plan: Plan
    links: Mapping[str, Description]
    variables: tuple[Json, ...]
    """`VariableDeclaration`, and the places of each variable at the keys of the links' kinds."""


class Declarations:
    """What the mappings of all cells say, worked out once for each plan."""

    def __init__(self) -> None:
        self._known: dict[str, Declared] = {}

    def of(self, plan: Plan) -> Declared:
        """What this plan says."""
        known = self._known.get(plan.cell.name)
        if known is None or known.plan is not plan:
            known = self._known[plan.cell.name] = declare(plan)
        return known


def declare(plan: Plan) -> Declared:
    """What the plan says."""
    links = described(plan)
    variables = tuple(
        _declaration(plan, links, index) | _places(plan, links, index)
        for index in range(len(plan.cell.variables))
    )
    return Declared(plan, links, variables)


def _declaration(plan: Plan, links: Mapping[str, Description], index: int) -> Json:
    variable = plan.cell.variables[index]
    meanings = [link.meanings[index] for link in links.values() if index in link.meanings]
    bits = [link.bits[index] for link in links.values() if index in link.bits]
    is_input = variable.direction is Direction.INPUT
    found = VariableDeclaration(
        cell=plan.cell.name,
        number=variable.number,
        name=variable.name,
        direction=variable.direction.value,
        kind=variable.kind.name.lower(),
        robot=robot_name(variable),
        unit=variable.unit,
        lock=plan.cell.locks[variable.lock].name if variable.lock is not None else None,
        limits=None if variable.limits is None else [variable.limits.low, variable.limits.high],
        fallback=_fallback(variable.on_release if is_input else variable.on_stale),
        comment=variable.comment,
        meanings=_words(meanings),
        bits=_words(bits),
    )
    return cast("Json", found)


def _words(found: Sequence[Mapping[int, str]]) -> dict[str, str] | None:
    """The first of these tables as JSON has it."""
    return {str(number): words for number, words in found[0].items()} if found else None


def _places(plan: Plan, links: Mapping[str, Description], index: int) -> Json:
    """By name of the link, and at the key of each kind that has places."""
    found: Json = {kind.key: None if kind.has_one_place else [] for kind in kinds() if kind.place}
    for name, link in links.items():
        kind = kind_of(plan.links[name].kind)
        if kind.place:
            places = [place.fields for place in link.places.get(index, ())]
            found[name] = (places[0] if places else None) if kind.has_one_place else places
    return found


def cell_view(served: ServedCell, declared: Declared, now: float) -> Json:
    """One cell of the status, with the objects of its links at the keys of their kinds."""
    cell, verdict = served.cell, verdict_of(served, now)
    health, definition, quality = cell.health, cell.definition, cell.image.quality
    owners = cell.ownership.owners
    found = CellStatus(
        name=definition.name,
        source=served.plan.source,
        fingerprint=f"{definition.fingerprint:08X}",
        healthy=verdict.healthy,
        problems=list(verdict.problems),
        links=[_link(name, verdict, declared) for name in declared.links],
        writers=[_writer(cell, index, now) for index in range(len(definition.writers))],
        variables={"total": len(quality)} | {its.name.lower(): quality.count(its) for its in Quality},
        locks={
            "total": len(owners),
            "owned": len(owners) - owners.count(None),
            "operator": owners.count(OPERATOR),
        },
        writes={"accepted": health.writes_accepted, "refused": health.writes_refused},
        last_refusal=_last_refusal(cell, now),
        unserved={reason.name.lower(): count for reason, count in cell.health.unserved.items()},
        last_unserved=_last_unserved(cell, now),
        heartbeat=health.heartbeat,
        gaps=health.gaps,
    )
    return {**found, **_objects_of_links(served, declared, now)}


def _link(name: str, verdict: CellVerdict, declared: Declared) -> LinkStatus:
    part: PicturePart = verdict.links.get(name, verdict.robot)
    return LinkStatus(
        name=name,
        title=kind_of(declared.plan.links[name].kind).title,
        address=declared.links[name].address,
        level=part.level.name.lower(),
        words=part.words,
        detail=part.detail,
    )


def _objects_of_links(served: ServedCell, declared: Declared, now: float) -> Json:
    """What its kind promises of each link (`LinkKind.fields`), by name; null at the keys of kinds that name none."""
    found: Json = {kind.key: None for kind in kinds()}
    for name, description in declared.links.items():
        link = served.links[name]
        known = {**description.fields, **link.health().figures}
        if link is served.source:
            known |= _source(served.cell, now)
        kind = kind_of(declared.plan.links[name].kind)
        found[name] = {field: known.get(field) for field in kind.fields}
    return found


def _source(cell: Cell, now: float) -> Json:
    """What the core knows of the link that values come from."""
    health = cell.health
    return {
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
    }


def truth(served: ServedCell, index: int) -> tuple[Value, Quality] | None:
    """What stands beside a force: what the source of an output reports meanwhile, or what the robot reads back of an
    input, and how good that is. None: nobody knows.
    """
    cell = served.cell
    if cell.definition.variables[index].direction is Direction.OUTPUT:
        return cell.forcing.reported(index)
    held = served.source.read_back(index)
    if held is None:
        return None
    return held, Quality.GOOD if cell.freshness.state is Source.FRESH else Quality.STALE


def variable_state(served: ServedCell, index: int, now: float) -> VariableState:
    """How one variable is at this moment: all that changes. Cheap, so that a list of all is of one moment."""
    cell = served.cell
    lock = cell.definition.variables[index].lock
    owner = cell.ownership.owners[lock] if lock is not None else None
    force = cell.forcing.forces.get(index)
    return (
        cell.image.values[index],
        cell.image.quality[index],
        cell.image.age(index, now),
        None if owner is None else cell.definition.writer_name(owner),
        None if lock is None or owner is None else cell.ownership.remaining(lock, now),
        None if force is None else (force.value, force.until - now, truth(served, index), force.holder.title),
    )


def variable_view(declared: Json, state: VariableState) -> Json:
    """One variable: what is `declared` of it, and how it is."""
    value, quality, age, owner, lease, force = state
    # A literal, not a call of the type: this is asked for every variable of a full image, again and again.
    found: VariableStatus = {
        "value": plain_value(value),
        "quality": _QUALITIES[quality],
        "age": _seconds(age),
        "owner": owner,
        "lease": None if lease is None else _seconds(lease),
        "forced": None if force is None else _forced(force),
    }
    return {**declared, **found}


def _forced(force: ForceState) -> Json:
    value, left, reported, holder = force
    return {
        "value": plain_value(value),
        "remaining": _seconds(left),
        "reported": None if reported is None else plain_value(reported[0]),
        "reported_quality": None if reported is None else _QUALITIES[reported[1]],
        "by": holder or None,
    }


def lock_view(cell: Cell, index: int, now: float) -> LockStatus:
    """One lock."""
    definition, lock = cell.definition, cell.definition.locks[index]
    owner = cell.ownership.owners[index]
    return LockStatus(
        cell=definition.name,
        name=lock.name,
        members=[definition.variables[member].name for member in lock.members],
        owners=[definition.writers[writer].name for writer in lock.owners],
        takeover=lock.takeover,
        declared_lease=lock.lease,
        owner=None if owner is None else definition.writer_name(owner),
        remaining=None if owner is None else _seconds(cell.ownership.remaining(index, now)),
        by=holders(cell, index) or None,
    )


def holders(cell: Cell, lock: int) -> str:
    """For whom the operator has this lock; empty: a writer owns it, or nobody, or it is not known."""
    found = cell.forcing.holders(lock, cell.definition.locks[lock].members)
    return ", ".join(filter(None, (holder.title for holder in found)))


def event_view(cell: Cell, seq: int, event: Event, now: float, wall: float) -> EventMessage:
    """One event; what does not apply is left out."""
    record = EventRecord.of(event, cell.definition)
    found: Json = {
        "seq": seq,
        "time": utc(wall - (now - event.time)),
        "cell": cell.definition.name,
        "event": record.what,
        "variable": record.variable,
        "lock": record.lock,
        "writer": record.writer,
        "other": record.holder,
        "reason": record.reason,
        "peer": record.peer,
        "old": plain_value(record.old),
        "new": plain_value(record.new),
        "repeats": event.repeats or None,
        "request": record.request or None,
        "detail": record.detail or None,
        "text": record.text(),
        "bad": record.bad,
    }
    return cast("EventMessage", {field: value for field, value in found.items() if value is not None})


def record_view(record: Record) -> AuditRecord:
    """One record of the audit, as its file has it, and in words."""
    return cast("AuditRecord", {**record.as_json(), "text": record.event.text(), "bad": record.event.bad})


def _writer(cell: Cell, index: int, now: float) -> WriterStatus:
    writer, table = cell.definition.writers[index], cell.writers
    return WriterStatus(
        name=writer.name,
        alive=table.alive[index],
        connections=table.connections[index],
        age=_seconds(now - table.last_seen[index]),
        timeout=writer.timeout,
        locks=len(cell.ownership.held_by(index)),
    )


def _last_refusal(cell: Cell, now: float) -> RefusalStatus | None:
    last = cell.last_refusal
    if last is None:
        return None
    refusal, writer = last.refusal, last.writer
    event = Event(
        last.time,
        EventKind.REFUSED,
        refusal.variable,
        writer=writer,
        other=refusal.holder,
        reason=refusal.reason,
        detail=refusal.hint,
        peer=last.peer,
        request=refusal.request,
    )
    record = EventRecord.of(event, cell.definition)
    return RefusalStatus(
        variable=record.variable,
        writer=None if writer is None else record.writer,
        holder=record.holder,
        reason=record.reason,
        age=_seconds(now - last.time),
        text=record.text(),
    )


def _last_unserved(cell: Cell, now: float) -> UnservedStatus | None:
    event = cell.last_unserved
    if event is None:
        return None
    record = EventRecord.of(event, cell.definition)
    return UnservedStatus(
        writer=None if event.writer is None else record.writer,
        peer=record.peer,
        reason=record.reason,
        age=_seconds(now - event.time),
        text=record.text(),
    )


def _fallback(fallback: Fallback) -> object:
    return plain_value(fallback.value) if fallback.kind is FallbackKind.VALUE else fallback.kind.value


def _seconds(seconds: float) -> float | None:
    """To the millisecond; None for never and for no end."""
    return round(max(0.0, seconds), 3) if math.isfinite(seconds) else None
