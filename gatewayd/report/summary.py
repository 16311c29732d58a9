"""How the gateway is, in one sentence that a human understands: `systemctl status` shows it.

A good cell reads `press-3: robot fresh at 500 Hz, 2 of 2 writers connected, 3 locks held`. What is wrong comes first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from gatewayd.core.cell import Cell
from gatewayd.core.freshness import Source
from gatewayd.report.format import counted
from gatewayd.report.verdict import CellVerdict

MAX_LIST = 4
"""Cells reported one by one; of more, only those with problems, and the others as a number."""


def summary(cells: Sequence[tuple[Cell, CellVerdict]], troubles: Iterable[str] = ()) -> str:
    """`troubles` concern the gateway as a whole and stand in front."""
    ill = [_cell(cell, verdict) for cell, verdict in cells if not verdict.healthy]
    well = [_cell(cell, verdict) for cell, verdict in cells if verdict.healthy]
    parts = [trouble for trouble in troubles if trouble]
    if len(cells) <= MAX_LIST:
        parts += [*ill, *well]
    else:
        parts += ill[:MAX_LIST]
        more = len(ill) - MAX_LIST
        if more > 0:
            parts.append(f"{counted(more, 'more cell')} with trouble")
        if well:
            parts.append(_others(len(well), all_of_them=not ill))
    return "; ".join(parts) or "no cell to serve"


def _others(well: int, *, all_of_them: bool) -> str:
    if all_of_them:
        return f"all {counted(well, 'cell')} well"
    return f"the other {counted(well, 'cell')} well" if well > 1 else "the other cell well"


def _cell(cell: Cell, verdict: CellVerdict) -> str:
    facts = []
    if cell.freshness.state is Source.FRESH:
        facts.append(
            "robot fresh" + (f" at {round(cell.health.frequency)} Hz" if cell.health.frequency else "")
        )
    facts += verdict.problems
    writers = cell.writers.alive
    if writers:
        facts.append(f"{sum(writers)} of {counted(len(writers), 'writer')} connected")
    if cell.ownership.owners:
        held = sum(owner is not None for owner in cell.ownership.owners)
        facts.append(f"{counted(held, 'lock')} held")
    return f"{cell.definition.name}: {', '.join(facts)}"
