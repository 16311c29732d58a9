"""What the daemon needs of this kind of link."""

from __future__ import annotations

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Context, LinkRuntime
from gatewayd.links.robot.dashboard.link import DashboardLink
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.mapping.plan import LinkPlan


class DashboardRuntime(LinkRuntime):
    """Links to dashboard servers."""

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> DashboardLink:
        """A link; nothing of a former one goes on."""
        assert isinstance(plan, DashboardPlan)
        return DashboardLink(plan, cell)


RUNTIME = DashboardRuntime()
"""What the daemon needs of this kind of link."""
