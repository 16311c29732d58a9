"""What became of the last command, as the number that the state `result` has."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Final

from gatewayd.core.commands import Obstacle
from gatewayd.dashboard.replies import CommandOutcome


class CommandResult(IntEnum):
    """The numbers stand in PLC programs: never renumber, only append."""

    NONE = 0
    UNDER_WAY = 1
    DONE = 2
    FAILED = 3
    LOCAL_CONTROL = 4
    NO_PROGRAM = 5
    FILE_NOT_FOUND = 6
    LOAD_ERROR = 7
    TOO_SOON = 8
    NOT_UNDERSTOOD = 9
    STRANGE_ANSWER = 10
    NO_ANSWER = 11
    NOT_CONNECTED = 12
    BUSY = 13
    ROBOT_AWAY = 14
    NO_SUCH_NUMBER = 15
    NOT_CLEARED = 16
    IMPLIED = 17
    WAITED = 18

    @property
    def words(self) -> str:
        """What it means."""
        return WORDS[self]

    @property
    def is_refusal(self) -> bool:
        """Whether the robot did not do it, or nobody knows whether it did."""
        return self > CommandResult.DONE


WORDS: Final[Mapping[CommandResult, str]] = {
    CommandResult.NONE: "no command yet",
    CommandResult.UNDER_WAY: "under way",
    CommandResult.DONE: "carried out",
    CommandResult.FAILED: "the robot could not: mode, safety status or program do not allow it",
    CommandResult.LOCAL_CONTROL: "the robot is in local control",
    CommandResult.NO_PROGRAM: "no program is loaded",
    CommandResult.FILE_NOT_FOUND: "the controller does not have the program",
    CommandResult.LOAD_ERROR: "the program could not be loaded",
    CommandResult.TOO_SOON: "a protective stop cannot be unlocked in its first 5 s",
    CommandResult.NOT_UNDERSTOOD: "the controller does not know the command",
    CommandResult.STRANGE_ANSWER: "the answer was not understood",
    CommandResult.NO_ANSWER: "no answer: nobody knows whether the robot did it",
    CommandResult.NOT_CONNECTED: "not sent: no connection, or the controller was busy",
    CommandResult.BUSY: "not sent: another command was under way",
    CommandResult.ROBOT_AWAY: "not sent: the robot's values are not fresh",
    CommandResult.NO_SUCH_NUMBER: "no program has this number",
    CommandResult.NOT_CLEARED: "ignored: its owner has to write 0 before, by the same connection",
    CommandResult.IMPLIED: "ignored: written only because it shares a register",
    CommandResult.WAITED: "ignored: it waited while the gateway stood still",
}

BY_OBSTACLE: Final[Mapping[Obstacle, CommandResult]] = {
    Obstacle.NOT_CLEARED: CommandResult.NOT_CLEARED,
    Obstacle.IMPLIED: CommandResult.IMPLIED,
    Obstacle.WAITED: CommandResult.WAITED,
}
BY_OUTCOME: Final[Mapping[CommandOutcome, CommandResult]] = {
    CommandOutcome.DONE: CommandResult.DONE,
    CommandOutcome.FAILED: CommandResult.FAILED,
    CommandOutcome.LOCAL: CommandResult.LOCAL_CONTROL,
    CommandOutcome.NOT_FOUND: CommandResult.FILE_NOT_FOUND,
    CommandOutcome.LOAD_ERROR: CommandResult.LOAD_ERROR,
    CommandOutcome.TOO_SOON: CommandResult.TOO_SOON,
    CommandOutcome.UNKNOWN: CommandResult.NOT_UNDERSTOOD,
    CommandOutcome.STRANGE: CommandResult.STRANGE_ANSWER,
    CommandOutcome.NOT_SENT: CommandResult.NOT_CONNECTED,
    CommandOutcome.UNANSWERED: CommandResult.NO_ANSWER,
}
