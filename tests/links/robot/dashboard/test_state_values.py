"""What the server said, as numbers."""

from __future__ import annotations

from gatewayd.dashboard.state import RobotState
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.links.robot.dashboard.state_values import values_of

PLAN = DashboardPlan("127.0.0.1", 29999, 0.5, ((4, "pick.urp"),))


def test_words_become_the_numbers_of_packages() -> None:
    state = RobotState("POWER_OFF", "PLAYING", "/programs/pick.urp", "PROTECTIVE_STOP", False)
    assert values_of(state, PLAN) == {
        "robot_mode": 3,
        "program_state": 2,
        "loaded": 4,
        "safety_status": 3,
        "remote_control": False,
    }


def test_what_is_not_said_or_not_known_is_none() -> None:
    assert set(values_of(RobotState(), PLAN).values()) == {None}
    strange = RobotState("DANCING", "PLAYING", "", "HAPPY")
    assert values_of(strange, PLAN) == {
        "robot_mode": None,
        "program_state": 2,
        "loaded": 0,
        "safety_status": None,
        "remote_control": None,
    }
