"""The states and steps of a negotiation: what is awaited, what is to be sent next, what is to be reported."""

from __future__ import annotations

from enum import Enum, auto
from typing import NamedTuple

from gatewayd.rtde import messages


class State(Enum):
    """What is awaited; the value completes "waiting for ..."."""

    NEW = "the first message"
    VERSION = "the answer to the protocol version"
    VERSION_2 = "the answer to protocol version 2"
    VERSION_1 = "the answer to protocol version 1"
    CONTROLLER = "the controller version"
    INPUTS = "the answer to an input recipe"
    READING_SETUP = "the answer to the output recipe of a reading"
    READING_START = "the answer to the start of a reading"
    READING = "the package of a reading"
    READING_PAUSE = "the answer to the pause of a reading"
    OUTPUTS = "the answer to the output recipe"
    STARTING = "the answer to the start"
    RUNNING = "data"
    PAUSING = "the answer to the pause"
    PAUSED = "nothing, being paused"
    RESUMING = "the answer to the restart"


class Notice(Enum):
    """Something to report to the user of the client."""

    STARTED = auto()
    INPUTS_CHANGED = auto()
    CHANGED = auto()
    PAUSED = auto()
    RESUMED = auto()
    PROBED = auto()


class NextStep(NamedTuple):
    """What follows from a message."""

    send: messages.ExecutableMessage | None = None
    event: Notice | None = None
    strange: str = ""
    """What is odd about the message, if anything is."""
    taken: bool = True
    """Whether the message was an answer to what is awaited; else nothing has changed."""
