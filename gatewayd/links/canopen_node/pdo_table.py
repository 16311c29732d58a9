"""The PDO table of a cell, as a master's programmer needs it, and the load of the bus for each bit-rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.bus_load import (
    BIT_RATES,
    FIRST_EVENT_TYPE,
    bus_shares,
    load,
    pdo_rate,
    station_of,
)
from gatewayd.links.canopen_node.expand import ExpandedPdo, MappedObject, node_of
from gatewayd.links.canopen_node.status_words import StatusWord
from gatewayd.mapping.expanded import ExpandedCell

__all__ = [
    "PdoRow",
    "PdoRun",
    "as_document",
    "by_sdo_only",
    "load_by_bit_rate",
    "object_place",
    "pdo_rows",
    "transmission_words",
]


@dataclass(frozen=True, slots=True)
class PdoRun:
    """Neighbouring variables of one line in a PDO, or a word of the status block."""

    names: str
    """`start`, or `recipe[0..1]`; `status: flags`."""
    bit: int
    """Where the first begins, 0 the least significant bit of the first byte."""
    bits: int
    """Bits of all."""
    objects: str
    """`2020h:01`, or `2020h:01-02`."""
    type: str


@dataclass(frozen=True, slots=True)
class PdoRow:
    """One PDO."""

    pdo: str
    """`RPDO 1`; with a name of the file `RPDO 1 (command)`."""
    direction: Direction
    cob_id: str
    """`0x190`."""
    predefined: bool
    transmission: str
    """`event (254)`, `sync (1)`, `every 4th SYNC`."""
    inhibit: float | None
    """Seconds; None for synchronous PDOs too, which have none."""
    event: float | None
    """Seconds: event timer, or deadline."""
    rate: float
    """Frames per second in the worst case."""
    runs: tuple[PdoRun, ...]


def object_place(one: MappedObject) -> str:
    """Index and sub-index, both hexadecimal as in a manual: `2000h:01`."""
    return f"{one.plan.index:04X}h:{one.plan.subindex:02X}"


def transmission_words(transmission: int) -> str:
    """A transmission type in words and as a number."""
    if transmission >= FIRST_EVENT_TYPE:
        return f"event ({transmission})"
    if transmission == 0:
        return "sync, on change (0)"
    return "sync (1)" if transmission == 1 else f"every {transmission} SYNCs ({transmission})"


def pdo_rows(cell: ExpandedCell) -> tuple[PdoRow, ...]:
    """The PDOs of a cell without errors: those towards the robot, then those from it; none without a node."""
    node = node_of(cell)
    if node is None:
        return ()
    station = station_of(cell, node)
    found = []
    for pdo in node.pdos:
        assert pdo.slot.cob_id is not None
        event_driven = pdo.transmission >= FIRST_EVENT_TYPE
        found.append(
            PdoRow(
                pdo.label,
                pdo.direction,
                f"0x{pdo.slot.cob_id:03X}",
                pdo.slot.predefined,
                transmission_words(pdo.transmission),
                pdo.inhibit if event_driven else None,
                pdo.event if event_driven or pdo.direction is Direction.INPUT else None,
                pdo_rate(pdo, station.rate, node.part.spec.sync.period),
                _runs(cell, pdo),
            )
        )
    return tuple(found)


def by_sdo_only(cell: ExpandedCell) -> tuple[str, ...]:
    """Variables that are objects and in no PDO, each with its place: `recipe[3] 2020h:04`."""
    node = node_of(cell)
    if node is None:
        return ()
    carried = {entry.variable for pdo in node.pdos for entry in pdo.entries}
    return tuple(
        f"{cell.variables[one.variable].name} {object_place(one)}"
        for one in node.objects
        if one.variable not in carried
    )


def load_by_bit_rate(cell: ExpandedCell) -> dict[int, float]:
    """The share of the bus that this cell alone can take, by bit-rate; empty without a node."""
    node = node_of(cell)
    if node is None:
        return {}
    shares = bus_shares([station_of(cell, node)])
    return {bit_rate: load(shares, bit_rate) for bit_rate in BIT_RATES}


def as_document(cell: ExpandedCell) -> dict[str, Any] | None:
    """The node for JSON: `interface`, `channel`, `bitrate`, `node`, `pdos` and `load`; None without one."""
    node = node_of(cell)
    if node is None:
        return None
    spec = node.part.spec
    return {
        "interface": spec.interface,
        "channel": spec.channel,
        "bitrate": spec.bitrate,
        "node": spec.node,
        "pdos": [
            {
                "pdo": row.pdo,
                "direction": row.direction.value,
                "cob_id": row.cob_id,
                "predefined": row.predefined,
                "transmission": pdo.transmission,
                "inhibit": row.inhibit,
                "event": row.event,
                "rate": row.rate,
                "variables": [
                    {
                        "name": cell.variables[one.variable].name,
                        "bit": bit,
                        "bits": one.plan.type.bits,
                        "object": object_place(one),
                        "type": one.plan.type.name,
                    }
                    for bit, one in pdo.offsets
                ],
                "status": [
                    {
                        "name": word.name,
                        "bit": bit,
                        "bits": word.type.bits,
                        "object": _status_place(word),
                        "type": word.type.name,
                    }
                    for bit, word in pdo.status_offsets
                ],
            }
            for row, pdo in zip(pdo_rows(cell), node.pdos, strict=True)
        ],
        "load": {str(bit_rate): round(share, 6) for bit_rate, share in load_by_bit_rate(cell).items()},
    }


def _runs(cell: ExpandedCell, pdo: ExpandedPdo) -> tuple[PdoRun, ...]:
    groups: list[list[tuple[int, MappedObject]]] = []
    for bit, one in pdo.offsets:
        if groups and _follows(cell, groups[-1][-1][1], one):
            groups[-1].append((bit, one))
        else:
            groups.append([(bit, one)])
    words = (
        PdoRun(f"status: {word.name}", bit, word.type.bits, _status_place(word), word.type.name)
        for bit, word in pdo.status_offsets
    )
    return (*words, *(_run(cell, group) for group in groups))


def _status_place(word: StatusWord) -> str:
    return f"{word.index:04X}h:{word.subindex:02X}"


def _follows(cell: ExpandedCell, earlier: MappedObject, later: MappedObject) -> bool:
    first, second = cell.variables[earlier.variable], cell.variables[later.variable]
    return (
        first.part is second.part
        and second.index == first.index + 1
        and (later.plan.index, later.plan.subindex) == (earlier.plan.index, earlier.plan.subindex + 1)
    )


def _run(cell: ExpandedCell, group: list[tuple[int, MappedObject]]) -> PdoRun:
    bit, first = group[0]
    last = group[-1][1]
    names = cell.variables[first.variable].name
    objects = object_place(first)
    if len(group) > 1:
        member = cell.variables[last.variable].member
        names = f"{names.removesuffix(']')}..{member}]"
        objects += f"-{last.plan.subindex:02X}"
    return PdoRun(names, bit, sum(one.plan.type.bits for _, one in group), objects, first.plan.type.name)
