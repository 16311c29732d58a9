"""The dashboard server of a plan in words."""

from __future__ import annotations

from dataclasses import replace

from gatewayd.links.registry import kind_of
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from tests.links.robot.dashboard.cells import LOADED, PROGRAM, RESULT, START, STATE, planned

KIND = kind_of("dashboard")


def test_settings_and_meanings() -> None:
    plan = planned()
    found = KIND.describe(plan.the(DashboardPlan), plan.cell)
    assert found.address == "127.0.0.1:29999"
    assert found.settings["programs"] == "1:'pick.urp' 2:'none.urp'"
    assert found.meanings[LOADED] == {0: "none of these", 1: "pick.urp", 2: "none.urp"}
    assert found.meanings[PROGRAM] == {1: "pick.urp", 2: "none.urp"}
    assert found.meanings[STATE][2] == "running"
    assert found.meanings[RESULT][4] == "the robot is in local control"
    assert START not in found.meanings


def test_the_connection_goes_on_to_the_same_server() -> None:
    cell = planned().cell
    plan = DashboardPlan("127.0.0.1", 29999, 0.5)
    assert KIND.fits(plan, replace(plan, programs=((1, "x.urp"),)), cell, cell)
    for other in (replace(plan, host="127.0.0.2"), replace(plan, port=1), replace(plan, period=1.0)):
        assert not KIND.fits(plan, other, cell, cell)
        assert not KIND.moved(plan, other)
