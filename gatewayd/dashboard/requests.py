"""What a dashboard server is asked for: commands, and questions for its state.

As Universal Robots documents them for CB3 and e-Series (the articles "Dashboard Server, port 29999"). Words are the
same on both; what a series or its older software does not have, it does not understand (`CommandOutcome.UNKNOWN`).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Verb(Enum):
    """What changes something; the value is the line that is sent, for `LOAD` its beginning."""

    PLAY = "play"
    STOP = "stop"
    PAUSE = "pause"
    LOAD = "load"
    UNLOCK = "unlock protective stop"
    POWER_ON = "power on"
    BRAKE_RELEASE = "brake release"


class StateQuestion(Enum):
    """What changes nothing; the value is the line that is sent."""

    ROBOT_MODE = "robotmode"
    PROGRAM = "programState"
    LOADED = "get loaded program"
    SAFETY_STATUS = "safetystatus"
    """From 3.11 and 5.4 on."""
    SAFETY_MODE = "safetymode"
    """The same in fewer words, for older software."""
    REMOTE = "is in remote control"
    """e-Series from 5.6 on; a CB3 controller knows no local control."""


DEFAULT_PORT = 29999
"""Where a controller listens."""
ANSWER_WITHIN = 15.0
"""Seconds within which commands are answered: `play` returns when the program has been started."""
LOADED_WITHIN = 120.0
"""Seconds within which `load` is answered: when program and installation have been loaded."""
SENT_WITHIN = 0.5
"""Seconds for which a command may wait for the answer to a question before it; nobody expects it later."""
ANSWERED_WITHIN = 5.0
"""Seconds within which questions are answered, by a controller that is busy too."""


@dataclass(frozen=True, slots=True)
class DashboardRequest:
    """One command."""

    command: Verb
    program: str = ""
    """What is to be loaded, for `LOAD`: a path below the programs of the controller."""

    @property
    def line(self) -> str:
        """What is sent."""
        return f"{self.command.value} {self.program}" if self.command is Verb.LOAD else self.command.value

    @property
    def patience(self) -> float:
        """Seconds within which it is answered."""
        return LOADED_WITHIN if self.command is Verb.LOAD else ANSWER_WITHIN


def is_program(name: str) -> bool:
    """Whether a name can be sent as a program: one line of ASCII, not too long, without blanks at its ends."""
    return 0 < len(name) <= 255 and name.isascii() and name.isprintable() and name == name.strip()
