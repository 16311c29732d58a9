"""Real answers of CB3 and e-Series controllers, and hostile ones."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.dashboard.replies import CommandOutcome, answer_to, is_unknown, reply_to
from gatewayd.dashboard.requests import StateQuestion, Verb
from gatewayd.simulator.dashboard import LOCAL, TOO_SOON


@pytest.mark.parametrize(
    "command, line, outcome",
    [
        (Verb.PLAY, "Starting program", CommandOutcome.DONE),
        (Verb.PLAY, "Failed to execute: play", CommandOutcome.FAILED),
        (Verb.PLAY, LOCAL, CommandOutcome.LOCAL),
        (Verb.POWER_ON, "Not in remote control", CommandOutcome.LOCAL),
        (Verb.STOP, "Stopped", CommandOutcome.DONE),
        (Verb.PAUSE, "Pausing program", CommandOutcome.DONE),
        (Verb.LOAD, "Loading program: pick.urp", CommandOutcome.DONE),
        (Verb.LOAD, "File not found: pick.urp", CommandOutcome.NOT_FOUND),
        (Verb.LOAD, "Error while loading program: pick.urp", CommandOutcome.LOAD_ERROR),
        (Verb.UNLOCK, "Protective stop releasing", CommandOutcome.DONE),
        (Verb.UNLOCK, TOO_SOON, CommandOutcome.TOO_SOON),
        (Verb.POWER_ON, "Powering on", CommandOutcome.DONE),
        (Verb.BRAKE_RELEASE, "Brake releasing", CommandOutcome.DONE),
        (Verb.BRAKE_RELEASE, "could not understand: 'brake release'", CommandOutcome.UNKNOWN),
        (Verb.PLAY, "Stopped", CommandOutcome.STRANGE),
        (Verb.PLAY, "", CommandOutcome.STRANGE),
    ],
)
def test_an_answer_to_a_command_has_a_kind(command: Verb, line: str, outcome: CommandOutcome) -> None:
    assert reply_to(command, line).outcome is outcome


@pytest.mark.parametrize(
    "question, line, word",
    [
        (StateQuestion.ROBOT_MODE, "Robotmode: POWER_OFF", "POWER_OFF"),
        (StateQuestion.PROGRAM, "PLAYING pick.urp", "PLAYING"),
        (StateQuestion.PROGRAM, "STOPPED <unnamed>", "STOPPED"),
        (StateQuestion.PROGRAM, "PAUSED", "PAUSED"),
        (StateQuestion.PROGRAM, "STOPPEDX", None),
        (StateQuestion.LOADED, "Loaded program: /programs/sub dir/pick.urp", "/programs/sub dir/pick.urp"),
        (StateQuestion.LOADED, "No program loaded", ""),
        (StateQuestion.SAFETY_STATUS, "Safetystatus: PROTECTIVE_STOP", "PROTECTIVE_STOP"),
        (StateQuestion.SAFETY_MODE, "Safetymode: NORMAL", "NORMAL"),
        (StateQuestion.REMOTE, "true", "TRUE"),
        (StateQuestion.REMOTE, "could not understand: 'is in remote control'", None),
        (StateQuestion.ROBOT_MODE, "Safetymode: NORMAL", None),
    ],
)
def test_an_answer_to_a_question_has_a_word(question: StateQuestion, line: str, word: str | None) -> None:
    assert answer_to(question, line) == word


def test_what_is_not_understood_is_known_as_such() -> None:
    assert is_unknown("could not understand: 'x'")
    assert not is_unknown("true")


@given(st.sampled_from(Verb), st.text())
def test_no_text_is_taken_for_success(command: Verb, line: str) -> None:
    known = ("start", "stop", "paus", "load", "prot", "powe", "brak")
    reply = reply_to(command, line)
    assert reply.text == line
    assert reply.outcome is not CommandOutcome.DONE or line.strip().lower().startswith(known)


@given(st.sampled_from(StateQuestion), st.text())
def test_any_text_is_an_answer_or_none(question: StateQuestion, line: str) -> None:
    word = answer_to(question, line)
    assert word is None or word.upper() in line.upper()
