"""The compiled link: where to send which variables under which names, and who may write."""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.mapping.plan import LinkPlan


@dataclass(frozen=True, slots=True)
class LinesPlan(LinkPlan):
    """One socket of one cell."""

    kind = "lines"

    listen: tuple[str, int]
    to: tuple[str, int]
    period: float
    names: tuple[tuple[int, str], ...]
    """Variable and the name that its lines have for it."""
    writers: tuple[tuple[str, int], ...]
    """Address -> writer."""
