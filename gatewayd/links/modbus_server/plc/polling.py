"""The poll plan of a PLC: few requests, none across what the unit does not serve, and none that several writers share.

A request is answered whole or refused whole. So what is held back while the robot is lost (`on_stale: exception`) is
read on its own, and what another writer may hold is written on its own.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Final

from gatewayd.core.definition import CellDefinition, FallbackKind
from gatewayd.core.status_layout import BASE, HEADER_WORDS, TABLES
from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.plc.model import WORD_BITS, PlcModel, Poll, RegisterTag
from gatewayd.modbus.areas import (
    MAX_READ_BITS,
    MAX_READ_REGISTERS,
    MAX_WRITE_BITS,
    MAX_WRITE_REGISTERS,
    Area,
)
from gatewayd.modbus.codec import TYPES

_MAX_GAP: Final = 8
"""Addresses with nothing mapped that are read too (`gaps: zero`), because another request costs more."""
_OFFSETS: Final = {table.name: table.offset for table in TABLES}


@dataclass(frozen=True, slots=True)
class _Cell:
    """Some addresses that are read or written together, with the tags in them."""

    addresses: range
    tags: tuple[RegisterTag, ...]
    apart: Hashable
    """Only what is alike in this lies in one request."""


@dataclass(slots=True)
class _Span:
    start: int
    stop: int
    apart: Hashable
    tags: list[RegisterTag] = field(default_factory=list)


def read_polls(tags: Sequence[RegisterTag], plan: ModbusPlan) -> Iterator[Poll]:
    """Requests that read all of these."""
    gap = _MAX_GAP if plan.fill_gaps else 0
    for area in (Area.HOLDING, Area.INPUT, Area.COIL, Area.DISCRETE):
        longest = MAX_READ_BITS if area.of_bits else MAX_READ_REGISTERS
        cells = _cells(tags, area, lambda _address, its: _is_held_back(its))
        for span in _spans(cells, longest, gap):
            yield Poll(
                "read", area, span.start, span.stop - span.start, tuple(span.tags), what="from the robot"
            )


def write_polls(
    tags: Sequence[RegisterTag], cell: CellDefinition, writer: int, others: dict[int, str]
) -> Iterator[Poll]:
    """Requests that write all of these. Raises ExportError where a register belongs to several writers.

    `others`: address of a holding register -> a variable there that this writer may not write.
    """
    for area in (Area.HOLDING, Area.COIL):
        longest = MAX_WRITE_BITS if area.of_bits else MAX_WRITE_REGISTERS
        kept = others if area is Area.HOLDING else {}

        def apart(address: int, its: Sequence[RegisterTag], kept: dict[int, str] = kept) -> Hashable:
            return _lock_of(address, its, cell, writer, kept)

        for span in _spans(_cells(tags, area, apart), longest, 0):
            shared = span.apart is not None
            what = "on demand: others may hold it" if shared else "to the robot"
            yield Poll(
                "write",
                area,
                span.start,
                span.stop - span.start,
                tuple(span.tags),
                writes=True,
                shared=shared,
                what=what,
            )


def status_polls(variables: int) -> Iterator[Poll]:
    """Requests for the status block: its header and the qualities in every round, owners in turns."""
    good = -(-variables // WORD_BITS)
    if HEADER_WORDS + good <= MAX_READ_REGISTERS:
        yield _status(0, HEADER_WORDS + good, "header, one bit for each good variable")
    else:
        yield _status(0, HEADER_WORDS, "header")
        yield _status(_OFFSETS["good"], good, "one bit for each good variable")
    for name, what in (("quality", "quality of each variable"), ("owner", "owner of each variable")):
        for start in range(0, variables, MAX_READ_REGISTERS):
            length = min(MAX_READ_REGISTERS, variables - start)
            yield replace(_status(_OFFSETS[name] + start, length, what), slow=True)


def numbered(polls: Iterable[Poll]) -> tuple[Poll, ...]:
    """With names of their own: `read1`, `read2`, `write1`."""
    counters: dict[str, Iterator[int]] = {}
    return tuple(
        replace(poll, name=f"{poll.name}{next(counters.setdefault(poll.name, count(1)))}") for poll in polls
    )


def plan_lines(model: PlcModel) -> tuple[str, ...]:
    """The poll plan as a table."""
    lines = [f"Modbus TCP {model.host}:{model.port}, unit {model.unit}"]
    for poll in model.polls:
        when = "in turns" if poll.slow else "on demand" if poll.shared else "every round"
        lines.append(
            f"{poll.name}: FC {poll.function}, address {poll.address} ({poll.notation}), count {poll.count}, "
            f"{when}: {poll.what}"
        )
    return tuple(lines)


def _status(offset: int, length: int, what: str) -> Poll:
    return Poll("status", Area.HOLDING, BASE + offset, length, what=what)


def _is_held_back(tags: Sequence[RegisterTag]) -> bool:
    return any(tag.on_stale.kind is FallbackKind.EXCEPTION for tag in tags)


def _lock_of(
    address: int, tags: Sequence[RegisterTag], cell: CellDefinition, writer: int, others: dict[int, str]
) -> int | None:
    """The lock that others may hold; None where all belong to this writer alone."""
    locks = {lock for tag in tags if (lock := cell.variables[tag.number - 1].lock) is not None}
    shared = {lock for lock in locks if cell.locks[lock].owners != (writer,)}
    if address in others or (shared and len(locks) > 1):
        names = ", ".join(f"`{tag.name}`" for tag in tags[:2])
        other = f"`{others[address]}`" if address in others else "bits of other owners"
        raise ExportError(
            f"register {address} holds {names} beside {other}, so no program can write it whole: give each writer "
            "registers of its own (GW520)"
        )
    return next(iter(shared), None)


def _cells(
    tags: Sequence[RegisterTag], area: Area, apart: Callable[[int, Sequence[RegisterTag]], Hashable]
) -> Iterator[_Cell]:
    """What lies at each address of an area, ascending; bits of a register together."""
    found: dict[int, list[RegisterTag]] = {}
    for tag in tags:
        if tag.area is area:
            found.setdefault(tag.address, []).append(tag)
    for address, its in sorted(found.items()):
        words = max(1 if tag.encoding is None else TYPES[tag.encoding.type].words for tag in its)
        yield _Cell(range(address, address + words), tuple(its), apart(address, its))


def _spans(cells: Iterable[_Cell], longest: int, gap: int) -> Iterator[_Span]:
    span: _Span | None = None
    for cell in cells:
        start, stop = cell.addresses.start, cell.addresses.stop
        fits = (
            span is not None
            and cell.apart == span.apart
            and start <= span.stop + gap
            and stop - span.start <= longest
        )
        if span is None or not fits:
            if span is not None:
                yield span
            span = _Span(start, stop, cell.apart)
        span.stop = max(span.stop, stop)
        span.tags += cell.tags
    if span is not None:
        yield span
