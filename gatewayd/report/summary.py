"""How the gateway is, in one sentence that a human understands: `systemctl status` shows it.

A good cell reads `press-3: robot fresh at 500 Hz, 2 of 2 writers connected, 3 locks held`. What is wrong comes first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from gatewayd.core.cell import Cell
from gatewayd.core.freshness import Source
from gatewayd.report.format import counted

__all__ = ["GREATEST_LIST", "sentence"]

GREATEST_LIST = 4
"""Cells told one by one; of more, only those with trouble, and the others as a number."""

_SOURCES = {
    Source.LOST: "robot not connected",
    Source.WAITING: "robot connected but sends no data yet",
    Source.FRESH: "robot fresh",
    Source.SILENT: "robot silent",
    Source.FROZEN: "robot frozen, its clock stands still",
    Source.LATE: "robot values come too late",
}


def sentence(cells: Sequence[Cell], troubles: Iterable[str] = ()) -> str:
    """`troubles` concern the gateway as a whole and stand in front."""
    ill = [cell for cell in cells if not _is_well(cell)]
    well = [cell for cell in cells if _is_well(cell)]
    parts = [trouble for trouble in troubles if trouble]
    if len(cells) <= GREATEST_LIST:
        parts += map(_told, [*ill, *well])
    else:
        parts += map(_told, ill[:GREATEST_LIST])
        more = len(ill) - GREATEST_LIST
        if more > 0:
            parts.append(f"{counted(more, 'more cell')} with trouble")
        if well:
            parts.append(f"{'all' if not ill else 'the other'} {counted(len(well), 'cell')} well")
    return "; ".join(parts) or "no cell to serve"


def _is_well(cell: Cell) -> bool:
    health = cell.health
    troubled = _unavailable(cell) or health.can_trouble or health.differing or health.unadopted
    return cell.freshness.state is Source.FRESH and not troubled and all(cell.writers.alive)


def _told(cell: Cell) -> str:
    facts = [_SOURCES[cell.freshness.state]]
    if cell.freshness.state is Source.FRESH:
        facts[0] += f" at {round(cell.health.frequency)} Hz" if cell.health.frequency else ""
        if not cell.accepts_writes:
            facts.append("its inputs not adopted yet")
    if cell.health.can_trouble:
        facts.append(f"CAN bus {cell.health.can_trouble}")
    if cell.health.unadopted:
        facts.append(f"{counted(cell.health.unadopted, 'input')} not known")
    if cell.health.differing:
        facts.append(f"{counted(cell.health.differing, 'input')} different in the robot")
    unavailable = _unavailable(cell)
    if unavailable:
        facts.append(f"{counted(unavailable, 'variable')} unavailable")
    writers = cell.writers.alive
    if writers:
        facts.append(f"{sum(writers)} of {counted(len(writers), 'writer')} connected")
    if cell.ownership.owners:
        held = sum(owner is not None for owner in cell.ownership.owners)
        facts.append(f"{counted(held, 'lock')} held")
    return f"{cell.definition.name}: {', '.join(facts)}"


def _unavailable(cell: Cell) -> int:
    return cell.image.available.count(False)
