"""What a dashboard server said of the robot, as values of variables."""

from __future__ import annotations

from gatewayd.core.definition import Value
from gatewayd.dashboard.state import RobotState
from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.links.robot.dashboard.variables import MODES, PROGRAM_STATES


def values_of(state: RobotState, plan: DashboardPlan) -> dict[str, Value | None]:
    """By name of the state; None: it is not known. A word without a number is not known either."""
    return {
        "robot_mode": _mode("robot_mode", state.robot_mode),
        "safety_status": _mode("safety_status", state.safety),
        "program_state": None if state.program is None else _program_state(state.program),
        "loaded": None if state.loaded is None else plan.number_of(state.loaded),
        "remote_control": state.remote,
    }


def _mode(name: str, word: str | None) -> int | None:
    known = {each.name: int(each) for each in MODES[name]}
    return None if word is None else known.get(word)


def _program_state(word: str) -> int | None:
    found = PROGRAM_STATES.get(word)
    return None if found is None else int(found)
