"""What a dashboard server said of the robot, put together from its answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gatewayd.dashboard.replies import answer_to, is_unknown
from gatewayd.dashboard.requests import StateQuestion


@dataclass(frozen=True, slots=True)
class RobotState:
    """The answers to one round of questions; None: the controller does not say, or not in a way that is understood."""

    robot_mode: str | None = None
    """`POWER_OFF`, `RUNNING`, ..."""
    program: str | None = None
    """`STOPPED`, `PLAYING` or `PAUSED`."""
    loaded: str | None = None
    """Path of the loaded program; empty: none is loaded."""
    safety: str | None = None
    """`NORMAL`, `PROTECTIVE_STOP`, ..."""
    remote: bool | None = None
    """Whether it is in remote control; None: it knows no local control."""


class Round:
    """The questions of one connection, asked again and again. What the controller does not know is not asked twice."""

    def __init__(self) -> None:
        self._unknown: set[StateQuestion] = set()

    @property
    def questions(self) -> tuple[StateQuestion, ...]:
        """What is to be asked; software without `SAFETY_STATUS` is asked for `SAFETY_MODE`."""
        safety = StateQuestion.SAFETY_STATUS
        if safety in self._unknown:
            safety = StateQuestion.SAFETY_MODE
        wanted = (
            StateQuestion.ROBOT_MODE,
            StateQuestion.PROGRAM,
            StateQuestion.LOADED,
            safety,
            StateQuestion.REMOTE,
        )
        return tuple(question for question in wanted if question not in self._unknown)

    def answered(self, question: StateQuestion, line: str) -> str | None:
        """The word in the answer, or None; remembers what the controller does not know."""
        if is_unknown(line):
            self._unknown.add(question)
        return answer_to(question, line)

    @staticmethod
    def state(words: Mapping[StateQuestion, str | None]) -> RobotState:
        """What the answers of one round say together."""
        remote = words.get(StateQuestion.REMOTE)
        return RobotState(
            words.get(StateQuestion.ROBOT_MODE),
            words.get(StateQuestion.PROGRAM),
            words.get(StateQuestion.LOADED),
            words.get(StateQuestion.SAFETY_STATUS) or words.get(StateQuestion.SAFETY_MODE),
            None if remote is None else remote == "TRUE",
        )
