"""The field by which the robot program learns that gateway and writers live: it counts while both do."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.core.freshness import Source
from gatewayd.links.robot.plan import WatchdogPlan
from gatewayd.rtde.claims import WATCHDOG_KEY
from gatewayd.rtde.client import RtdeClient

_FEED_LIMIT = 1 << 31


class WatchdogFeed:
    """Feeds the watchdog of one link."""

    def __init__(self, client: RtdeClient) -> None:
        self.ends = False
        """The link is about to end: the program is not to count on the gateway any longer."""
        self._client = client
        self._count = 0

    def feed(self, plan: WatchdogPlan, cell: Cell) -> None:
        """Send the next count, where all is well; `Health.watchdog_fed` says whether that was done."""
        cell.health.watchdog_fed = self._is_healthy(plan, cell) and self._send()
        self._count = (self._count + 1) % _FEED_LIMIT

    def _send(self) -> bool:
        session = self._client.session
        recipe = session.inputs.get(WATCHDOG_KEY) if session is not None else None
        return recipe is not None and self._client.send(recipe, (self._count,))

    def _is_healthy(self, plan: WatchdogPlan, cell: Cell) -> bool:
        """Whether the robot is heard, and every writer that the watchdog stands for is alive."""
        if self.ends or cell.freshness.state is not Source.FRESH:
            return False
        return all(cell.writers.alive[writer] for writer in plan.requires)
