"""What `gatewayd doctor` finds of a dashboard server."""

from __future__ import annotations

from gatewayd.dashboard.state import RobotState
from gatewayd.links.examination import Outcome, Surroundings
from gatewayd.links.registry import examination_of
from gatewayd.links.robot.dashboard.doctor import observations
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.dashboard import PolyScope
from gatewayd.simulator.dashboard_server import DashboardServer
from tests.links.robot.dashboard.cells import planned

PLAN = DashboardPlan("127.0.0.1", 29999, 0.5, ((1, "pick.urp"),))


def found(met: RobotState | str) -> list[tuple[Outcome, str]]:
    return [(each.outcome, each.text) for each in observations(PLAN, met)]


def test_a_server_that_is_away_is_a_problem() -> None:
    assert found("connection refused") == [(Outcome.PROBLEM, "127.0.0.1:29999: connection refused")]


def test_local_control_and_other_programs_are_said() -> None:
    state = RobotState("RUNNING", "STOPPED", "/programs/other.urp", "NORMAL", remote=False)
    assert found(state)[1:] == [
        (Outcome.WARNING, "the robot is in local control"),
        (Outcome.NOTE, "/programs/other.urp is loaded: none of `programs`"),
    ]
    assert found(RobotState(loaded=""))[-1] == (Outcome.NOTE, "no program is loaded")


async def test_it_asks_a_robot_and_commands_nothing() -> None:
    server = DashboardServer(PolyScope(Controller()))
    await server.start()
    examination = examination_of("dashboard")
    assert examination is not None
    plan = DashboardPlan("127.0.0.1", server.port, 0.5, ((1, "pick.urp"),))
    seen = [each async for each in examination.examine(plan, planned().cell, Surroundings())]
    assert [each.outcome for each in seen] == [Outcome.OK, Outcome.OK]
    assert seen[1].text == "/programs/pick.urp is loaded: number 1"
    assert set(server.heard) == {
        "robotmode", "programState", "get loaded program", "safetystatus", "is in remote control",
    }  # fmt: skip
    await server.stop()
    seen = [each async for each in examination.examine(plan, planned().cell, Surroundings())]
    assert [each.outcome for each in seen] == [Outcome.PROBLEM]
