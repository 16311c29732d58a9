"""What stands for a link of a cell that another gateway serves: it says so, and does nothing."""

from __future__ import annotations

from typing import NoReturn

from gatewayd.core.cell import Cell
from gatewayd.links.access import AccessError, AccessProblem, PlaceRequest
from gatewayd.links.contract import Level, Link, LinkHealth
from gatewayd.links.registry import kind_of
from gatewayd.mapping.plan import LinkPlan

_WORDS = "silent: this gateway stands by"


class SilentLink(Link):
    """A link that does not run."""

    title = "silent link"

    def __init__(self, plan: LinkPlan, cell: Cell) -> None:
        self.plan = plan
        address = kind_of(plan.kind).describe(plan, cell.definition).address
        self._health = LinkHealth(f"{kind_of(plan.kind).title} {address}".strip(), Level.IDLE, _WORDS)

    def health(self) -> LinkHealth:
        """Idle."""
        return self._health

    async def ask(self, request: PlaceRequest) -> NoReturn:
        """Nobody is asked: the other gateway has the connection."""
        raise AccessError(AccessProblem.TAKEN, "this gateway stands by; ask the one that serves the cell")
