"""From an expanded cell without errors to the one immutable plan that core and links work from.

Deterministic: the same mapping gives an equal plan, whatever its comments and formatting.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Mapping
from enum import Enum
from functools import cache
from ipaddress import IPv4Network, IPv6Network
from typing import Any, Final

from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Limits,
    Lock,
    Value,
    ValueKind,
    Variable,
    Writer,
)
from gatewayd.links.registry import definer, languages
from gatewayd.mapping.expanded import ExpandedCell, ExpandedLock, ExpandedVariable
from gatewayd.mapping.model import WriterSpec
from gatewayd.mapping.plan import Plan
from gatewayd.mapping.shown import Shown, shown_of

_CASTS: Final[dict[ValueKind, Callable[[Value], Value]]] = {
    ValueKind.BOOL: bool,
    ValueKind.INT: round,
    ValueKind.FLOAT: float,
}


def compile_plan(cell: ExpandedCell) -> Plan:
    """Compile a cell that passed all rules; ValueError for one with parts that could not be read or expanded."""
    document, sections, settings = cell.document, cell.document.sections, cell.settings
    missing = [kind.key for kind in languages() if kind.required and kind.key not in sections]
    if missing or not document.cell or not cell.is_complete:
        raise ValueError(f"{document.source.name} has errors and cannot be compiled")
    writers = {name: index for index, name in enumerate(document.writers)}
    definition = CellDefinition(
        name=document.cell,
        fingerprint=0,
        variables=tuple(map(_variable, cell.variables, shown_of(cell))),
        locks=tuple(_lock(lock, writers) for lock in cell.locks),
        writers=tuple(_writer(name, part.spec) for name, part in document.writers.items()),
        stale_after=settings.stale_after,
        clear_on_connect=settings.clear_on_connect,
        adopt_for=next(
            (time for kind in languages() for time in kind.adopt_for(document)), settings.adopt_for
        ),
    )
    links = {name: link for kind in languages() for name, link in kind.compile_links(cell).items()}
    plan = Plan(document.source.name, definition, links)
    return dataclasses.replace(plan, cell=dataclasses.replace(definition, fingerprint=fingerprint(plan)))


def _variable(variable: ExpandedVariable, shown: Shown) -> Variable:
    spec, kind = variable.spec, variable.kind
    is_input = variable.direction is Direction.INPUT
    return Variable(
        number=variable.index + 1,
        name=variable.name,
        direction=variable.direction,
        kind=kind,
        field=variable.field,
        bit=variable.bit,
        element=variable.element,
        low=variable.low,
        high=variable.high,
        limits=Limits(*spec.limits, spec.clamp) if spec.limits is not None else None,
        on_stale=Fallback() if is_input else _fallback(spec.on_stale, kind),
        on_release=_fallback(spec.on_release, kind) if is_input else Fallback(),
        lock=variable.lock,
        deadband=spec.deadband,
        unit=spec.unit,
        comment=spec.comment,
        shown=shown.bounds,
        shows_nan=shown.nan,
        valid_running=variable.valid_running,
        via=variable.via,
    )


def _lock(lock: ExpandedLock, writers: Mapping[str, int]) -> Lock:
    owners = tuple(writers[name] for name in lock.owners)
    return Lock(lock.name, lock.members, owners, lock.takeover, lock.lease, lock.whole)


def _writer(name: str, spec: WriterSpec) -> Writer:
    return Writer(
        name,
        timeout=spec.timeout,
        grace=spec.grace or 0.0,
        counts_writes=spec.timeout_counts == "writes",
        heartbeat=next((time for kind in languages() if (time := kind.silence(spec)) is not None), None),
    )


def _fallback(fallback: Fallback, kind: ValueKind) -> Fallback:
    if fallback.value is None:
        return fallback
    return Fallback(FallbackKind.VALUE, _CASTS[kind](fallback.value))


_PLAIN: Final = frozenset({str, int, float, bool, type(None)})
_FOR_PEOPLE: Final = frozenset({"comment", "source", "fingerprint"})
_DERIVED: Final = {Variable: frozenset({"shown", "shows_nan"}), Writer: frozenset({"heartbeat"})}
"""Fields that follow from others, which count: places, and the consumers of CANopen."""


def fingerprint(plan: Plan) -> int:
    """32 bits of what the plan means: everything but the comments and the path of the file.

    Keys that stand at their default do not count, so that later versions of gatewayd can add some without
    changing the fingerprint of the mappings that do not use them.
    """
    text = json.dumps(_meaning(plan), sort_keys=True, separators=(",", ":"))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")


def _meaning(thing: Any) -> Any:
    if type(thing) in _PLAIN:
        return thing
    match thing:
        case Plan():
            absent = dict.fromkeys(language.key for language in languages() if language.counts_absent)
            links = {name: _meaning(link) for name, link in thing.links.items()}
            return {"cell": _meaning(thing.cell)} | absent | links
        case Enum():
            return thing.name
        case IPv4Network() | IPv6Network():
            return str(thing)
        case tuple():
            return [_meaning(item) for item in thing]
    if not dataclasses.is_dataclass(thing):
        return thing
    meaning = getattr(thing, "meaning", None)
    if meaning is not None:
        return meaning
    kind: type = type(thing)
    return {
        name: _meaning(value)
        for name, default in _fields_of(kind)
        if (value := getattr(thing, name)) is not default and value != default
    }


@cache
def _fields_of(kind: type[Any]) -> tuple[tuple[str, Any], ...]:
    """Names and defaults of the fields that carry meaning."""
    unwritten = definer().unwritten if kind is CellDefinition else {}
    without = _FOR_PEOPLE | _DERIVED.get(kind, frozenset())
    return tuple(
        (field.name, unwritten.get(field.name, field.default))
        for field in dataclasses.fields(kind)
        if field.name not in without and field.metadata.get("meaning", True)
    )
