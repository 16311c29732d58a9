"""What the daemon needs of this kind of link."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Context, LinkRuntime
from gatewayd.links.standby.link import StandbyLink
from gatewayd.links.standby.plan import StandbyPlan
from gatewayd.mapping.plan import LinkPlan


class StandbyRuntime(LinkRuntime):
    """Links to the other gateway."""

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> StandbyLink:
        """A link that stands by."""
        assert isinstance(plan, StandbyPlan)
        return StandbyLink(plan, cell, context.state)


RUNTIME = StandbyRuntime()
"""What the daemon needs of this kind of link."""
