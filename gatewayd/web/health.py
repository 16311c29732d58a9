"""Whether the process lives and whether every cell is served, with the reasons: `/healthz` and `/readyz`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from gatewayd.report.verdict import CellVerdict


def health(late: Sequence[str]) -> tuple[bool, dict[str, object]]:
    """Healthy while every part of the gateway makes progress. A robot or a PLC that is away plays no role."""
    return not late, {"healthy": not late, "reasons": [f"hangs: {name}" for name in late]}


def readiness(
    verdicts: Mapping[str, CellVerdict],
    late: Sequence[str],
    troubles: Iterable[str],
    remarks: Iterable[str] = (),
) -> tuple[bool, dict[str, object]]:
    """Ready while every cell is served: no part hangs or has trouble, robots are fresh and can be written.

    `verdicts` are by name of the cell. Writers that are not connected, and single registers that the controller
    refused, leave it ready; so do `remarks`, which are reasons to look all the same.
    """
    reasons = [f"hangs: {name}" for name in late] + [trouble for trouble in troubles if trouble]
    ready = not reasons and not any(verdict.unserved for verdict in verdicts.values())
    cells = {
        name: {"ready": not verdict.unserved, "reasons": list(verdict.unserved)}
        for name, verdict in verdicts.items()
    }
    return ready, {"ready": ready, "reasons": [*reasons, *remarks], "cells": cells}
