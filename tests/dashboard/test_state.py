"""A round of questions, to controllers that know more or less."""

from __future__ import annotations

from gatewayd.dashboard.requests import StateQuestion
from gatewayd.dashboard.state import RobotState, Round

UNKNOWN = "could not understand: 'x'"


def test_old_software_is_asked_in_its_own_words() -> None:
    asked = Round()
    assert StateQuestion.SAFETY_STATUS in asked.questions
    assert asked.answered(StateQuestion.SAFETY_STATUS, UNKNOWN) is None
    assert asked.answered(StateQuestion.REMOTE, UNKNOWN) is None
    assert asked.questions[-1] is StateQuestion.SAFETY_MODE
    words = {
        StateQuestion.SAFETY_STATUS: None,
        StateQuestion.SAFETY_MODE: "NORMAL",
        StateQuestion.REMOTE: None,
    }
    assert Round.state(words) == RobotState(safety="NORMAL")


def test_what_is_not_understood_for_once_is_asked_again() -> None:
    asked = Round()
    assert asked.answered(StateQuestion.ROBOT_MODE, "???") is None
    assert StateQuestion.ROBOT_MODE in asked.questions


def test_words_make_a_state() -> None:
    words = {StateQuestion.ROBOT_MODE: "RUNNING", StateQuestion.LOADED: "", StateQuestion.REMOTE: "FALSE"}
    assert Round.state(words) == RobotState("RUNNING", loaded="", remote=False)
