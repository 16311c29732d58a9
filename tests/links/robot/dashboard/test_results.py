"""Numbers of results, which PLC programs have built in."""

from __future__ import annotations

from gatewayd.core.commands import Obstacle
from gatewayd.dashboard.replies import CommandOutcome
from gatewayd.links.robot.dashboard.results import BY_OBSTACLE, BY_OUTCOME, WORDS, CommandResult


def test_the_numbers_stay() -> None:
    assert [result.name for result in CommandResult] == [
        "NONE", "UNDER_WAY", "DONE", "FAILED", "LOCAL_CONTROL", "NO_PROGRAM", "FILE_NOT_FOUND", "LOAD_ERROR",
        "TOO_SOON",
        "NOT_UNDERSTOOD", "STRANGE_ANSWER", "NO_ANSWER", "NOT_CONNECTED", "BUSY", "ROBOT_AWAY", "NO_SUCH_NUMBER",
        "NOT_CLEARED", "IMPLIED", "WAITED",
    ]  # fmt: skip
    assert list(CommandResult) == list(range(19))


def test_whatever_happens_has_a_result_in_words() -> None:
    assert WORDS.keys() == set(CommandResult)
    assert BY_OBSTACLE.keys() == set(Obstacle)
    assert BY_OUTCOME.keys() == set(CommandOutcome)
    assert CommandResult.NO_ANSWER.words.startswith("no answer")


def test_only_what_was_carried_out_is_no_refusal() -> None:
    assert [result for result in BY_OUTCOME.values() if not result.is_refusal] == [CommandResult.DONE]
    assert all(result.is_refusal for result in BY_OBSTACLE.values())
