"""The PDO table of a cell with a node, as a master's programmer needs it, and the load of the bus for each bit-rate."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from gatewayd.canopen.load import load
from gatewayd.core.definition import Direction
from gatewayd.links.canopen_node.bus_load import BIT_RATES, FIRST_EVENT_TYPE, bus_shares, pdo_rate
from gatewayd.links.canopen_node.expand import ExpandedPdo, MappedObject, the_node
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.report.wording import cob


@dataclass(frozen=True, slots=True)
class PdoItem:
    """A variable in a PDO, neighbouring variables of one line, or a word of the status block."""

    name: str
    """`start`, or `recipe[0..1]`; `flags`."""
    bit: int
    """Where the first begins, 0 the least significant bit of the first byte."""
    bits: int
    """Bits of all."""
    object: str
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
    transmission: int
    inhibit: float | None
    """Seconds; None for synchronous PDOs too, which have none."""
    event: float | None
    """Seconds: event timer, or deadline."""
    rate: float
    """Frames per second in the worst case."""
    variables: tuple[PdoItem, ...]
    """Each by itself."""
    status: tuple[PdoItem, ...]
    """Words of the status block, which come before the variables."""
    runs: tuple[PdoItem, ...]
    """The same with neighbours of one line together."""


def object_place(index: int, subindex: int) -> str:
    """Index and sub-index, both hexadecimal as in a manual: `2000h:01`."""
    return f"{index:04X}h:{subindex:02X}"


def transmission_words(transmission: int) -> str:
    """A transmission type in words and as a number: `event (254)`, `sync (1)`, `every 4 SYNCs (4)`."""
    if transmission >= FIRST_EVENT_TYPE:
        return f"event ({transmission})"
    if transmission == 0:
        return "sync, on change (0)"
    return "sync (1)" if transmission == 1 else f"every {transmission} SYNCs ({transmission})"


def pdo_rows(cell: ExpandedCell) -> tuple[PdoRow, ...]:
    """The PDOs of a cell without errors: those towards the robot, then those from it."""
    node = the_node(cell)
    period = node.part.spec.sync.period
    return tuple(_row(cell, pdo, pdo_rate(pdo, cell.settings.rate, period)) for pdo in node.pdos)


def by_sdo_only(cell: ExpandedCell) -> tuple[str, ...]:
    """Variables that are objects and in no PDO, each with its place: `recipe[3] 2020h:04`."""
    node = the_node(cell)
    carried = node.carried
    return tuple(
        f"{cell.variables[placed.variable].name} {object_place(placed.plan.index, placed.plan.subindex)}"
        for placed in node.objects
        if placed.variable not in carried
    )


def load_by_bit_rate(cell: ExpandedCell) -> dict[int, float]:
    """The share of the bus that this cell alone can take, by bit-rate."""
    shares = bus_shares([cell])
    return {bit_rate: load(shares, bit_rate) for bit_rate in BIT_RATES}


def as_document(cell: ExpandedCell) -> dict[str, Any]:
    """The node for JSON: `interface`, `channel`, `bitrate`, `node`, `pdos` and `load`."""
    spec = the_node(cell).part.spec
    pdos = [{**asdict(row), "direction": row.direction.value} for row in pdo_rows(cell)]
    for pdo in pdos:
        del pdo["runs"]
    return {
        "interface": spec.interface,
        "channel": spec.channel,
        "bitrate": spec.bitrate,
        "node": spec.node,
        "pdos": pdos,
        "load": {str(bit_rate): round(share, 6) for bit_rate, share in load_by_bit_rate(cell).items()},
    }


def _row(cell: ExpandedCell, pdo: ExpandedPdo, rate: float) -> PdoRow:
    assert pdo.slot.cob_id is not None
    event_driven = pdo.transmission >= FIRST_EVENT_TYPE
    return PdoRow(
        pdo.label,
        pdo.direction,
        cob(pdo.slot.cob_id),
        pdo.slot.predefined,
        pdo.transmission,
        pdo.inhibit if event_driven else None,
        pdo.event if event_driven or pdo.direction is Direction.INPUT else None,
        rate,
        tuple(_item(cell, [(bit, placed)]) for bit, placed in pdo.offsets),
        tuple(
            PdoItem(word.name, bit, word.type.bits, object_place(word.index, word.subindex), word.type.name)
            for bit, word in pdo.status_offsets
        ),
        tuple(_item(cell, run) for run in _runs(cell, pdo)),
    )


def _runs(cell: ExpandedCell, pdo: ExpandedPdo) -> Iterator[list[tuple[int, MappedObject]]]:
    run: list[tuple[int, MappedObject]] = []
    for bit, placed in pdo.offsets:
        if run and not _follows(cell, run[-1][1], placed):
            yield run
            run = []
        run.append((bit, placed))
    if run:
        yield run


def _follows(cell: ExpandedCell, earlier: MappedObject, later: MappedObject) -> bool:
    first, second = cell.variables[earlier.variable], cell.variables[later.variable]
    return (
        first.part is second.part
        and second.index == first.index + 1
        and (later.plan.index, later.plan.subindex) == (earlier.plan.index, earlier.plan.subindex + 1)
    )


def _item(cell: ExpandedCell, run: list[tuple[int, MappedObject]]) -> PdoItem:
    bit, first = run[0]
    last = run[-1][1]
    name = cell.variables[first.variable].name
    place = object_place(first.plan.index, first.plan.subindex)
    if len(run) > 1:
        name = f"{name.removesuffix(']')}..{cell.variables[last.variable].member}]"
        place += f"-{last.plan.subindex:02X}"
    return PdoItem(name, bit, sum(placed.plan.type.bits for _, placed in run), place, first.plan.type_text)
