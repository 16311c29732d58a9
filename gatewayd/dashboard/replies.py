"""What a dashboard server answers, by kind. What is not known is kept as text, and never taken for success.

Answers as documented by Universal Robots, and as seen by users where the documents are silent: that a command is "not
allowed due to safety reasons" in local control, and that the connection has to be opened anew afterwards.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from gatewayd.dashboard.requests import StateQuestion, Verb


class CommandOutcome(Enum):
    """What became of a command."""

    DONE = auto()
    FAILED = auto()
    """`Failed to execute: play`: the robot is not ready for it, and does not say why."""
    LOCAL = auto()
    """The robot is in local control."""
    NOT_FOUND = auto()
    """`File not found: x.urp`."""
    LOAD_ERROR = auto()
    """`Error while loading program: x.urp`; also where its installation has to be confirmed on the pendant."""
    TOO_SOON = auto()
    """`Cannot unlock protective stop until 5s after occurrence.`"""
    UNKNOWN = auto()
    """`could not understand: 'x'`: this controller does not have the command."""
    STRANGE = auto()
    """Any other answer."""
    NOT_SENT = auto()
    """The controller was busy with something else, or the connection ended before: it was never asked."""
    UNANSWERED = auto()
    """The connection ended before the answer came: nobody knows whether the robot did it."""


@dataclass(frozen=True, slots=True)
class DashboardReply:
    """The answer to a command."""

    outcome: CommandOutcome
    text: str
    """As it came, from outside; empty: nothing came."""


_DONE: Final = {
    Verb.PLAY: "starting program",
    Verb.STOP: "stopped",
    Verb.PAUSE: "pausing program",
    Verb.LOAD: "loading program:",
    Verb.UNLOCK: "protective stop releasing",
    Verb.POWER_ON: "powering on",
    Verb.BRAKE_RELEASE: "brake releasing",
}
"""How success begins, in small letters."""
_NOT_UNDERSTOOD: Final = "could not understand"
_BEGINNINGS: Final = (
    ("failed to execute", CommandOutcome.FAILED),
    ("file not found", CommandOutcome.NOT_FOUND),
    ("error while loading program", CommandOutcome.LOAD_ERROR),
    ("cannot unlock protective stop until", CommandOutcome.TOO_SOON),
    (_NOT_UNDERSTOOD, CommandOutcome.UNKNOWN),
    ("command is not allowed due to safety reasons", CommandOutcome.LOCAL),
    ("not in remote control", CommandOutcome.LOCAL),
)


def reply_to(command: Verb, line: str) -> DashboardReply:
    """What a line means as the answer to a command. Takes any text."""
    said = line.strip().lower()
    if said.startswith(_DONE[command]):
        return DashboardReply(CommandOutcome.DONE, line)
    found = (outcome for beginning, outcome in _BEGINNINGS if said.startswith(beginning))
    return DashboardReply(next(found, CommandOutcome.STRANGE), line)


NO_PROGRAM: Final = ""
"""The answer to `LOADED` where no program is loaded."""
_PATTERNS: Final = {
    StateQuestion.ROBOT_MODE: re.compile(r"robotmode:\s*([A-Z_]{1,64})", re.IGNORECASE),
    StateQuestion.PROGRAM: re.compile(r"(STOPPED|PLAYING|PAUSED)(?:\s.*)?", re.IGNORECASE),
    StateQuestion.LOADED: re.compile(r"loaded program:\s*(\S.*)|no program loaded", re.IGNORECASE),
    StateQuestion.SAFETY_STATUS: re.compile(r"safetystatus:\s*([A-Z0-9_]{1,64})", re.IGNORECASE),
    StateQuestion.SAFETY_MODE: re.compile(r"safetymode:\s*([A-Z0-9_]{1,64})", re.IGNORECASE),
    StateQuestion.REMOTE: re.compile(r"(true|false)", re.IGNORECASE),
}


def answer_to(question: StateQuestion, line: str) -> str | None:
    """The word in an answer: `RUNNING`, `PLAYING`, a path, `true`; None for any other line. Takes any text."""
    found = _PATTERNS[question].fullmatch(line.strip())
    if found is None:
        return None
    word = found[1] or NO_PROGRAM
    return word if question is StateQuestion.LOADED else word.upper()


def is_unknown(line: str) -> bool:
    """Whether the controller does not know what it was asked."""
    return line.strip().lower().startswith(_NOT_UNDERSTOOD)
