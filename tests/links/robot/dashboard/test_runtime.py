"""How a link is made."""

from __future__ import annotations

from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Context
from gatewayd.links.registry import runtime_of
from gatewayd.links.robot.dashboard.link import DashboardLink
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from tests.links.robot.dashboard.cells import START, UP, planned


async def test_a_link_has_no_command_to_offer_before_it_runs() -> None:
    plan = planned()
    cell = Cell(plan.cell)
    link = runtime_of("dashboard").make(plan.the(DashboardPlan), cell, Context(0.0, Path()))
    assert isinstance(link, DashboardLink)
    assert link.progress == 0
    assert not cell.image.available[START]
    assert cell.image.values[UP] is False
    assert cell.health.words["dashboard_state"] == 1
