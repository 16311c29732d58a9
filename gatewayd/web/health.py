"""Whether the process lives and whether every cell is served, with the reasons: `/healthz` and `/readyz`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from gatewayd.core.cell import Cell
from gatewayd.core.freshness import Source

__all__ = ["SOURCES", "health", "readiness", "unready"]

SOURCES = {
    Source.LOST: "robot not connected",
    Source.WAITING: "robot connected, but it sends no data yet",
    Source.FRESH: "robot fresh",
    Source.SILENT: "robot silent: connected, but no data comes",
    Source.FROZEN: "robot frozen: data comes, but its clock stands still",
    Source.LATE: "robot late: data comes, but too late to count as fresh",
}
"""The state of the robot in words."""


def health(late: Sequence[str]) -> tuple[bool, dict[str, object]]:
    """Healthy while every part of the gateway turns. A robot or a PLC that is away plays no role."""
    return not late, {"healthy": not late, "reasons": [f"hangs: {name}" for name in late]}


def readiness(
    cells: Iterable[Cell], late: Sequence[str], troubles: Iterable[str]
) -> tuple[bool, dict[str, object]]:
    """Ready while every cell is served: no part hangs or has trouble, robots are fresh and can be written.

    Writers that are not connected and single registers that the controller refused leave it ready.
    """
    reasons = [f"hangs: {name}" for name in late] + [trouble for trouble in troubles if trouble]
    found = {cell.definition.name: unready(cell) for cell in cells}
    ready = not reasons and not any(found.values())
    told = {name: {"ready": not why, "reasons": why} for name, why in found.items()}
    return ready, {"ready": ready, "reasons": reasons, "cells": told}


def unready(cell: Cell) -> list[str]:
    """Why the cell is not served; empty if it is."""
    if cell.freshness.state is not Source.FRESH:
        return [SOURCES[cell.freshness.state]]
    return [] if cell.accepts_writes else ["the robot's inputs are not adopted yet"]
