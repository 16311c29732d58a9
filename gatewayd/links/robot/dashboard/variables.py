"""The variables that the dashboard server brings: commands, which are inputs, and states, which are outputs.

States have the numbers of RTDE's fields of the same meaning, so that a PLC program reads either alike.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Final, Literal, TypeAlias

from gatewayd.core.definition import ValueKind
from gatewayd.dashboard.requests import Verb
from gatewayd.links.robot.dashboard.results import WORDS
from gatewayd.rtde.enums import MEANINGS, ProgramState, RobotMode, SafetyStatus

VIA: Final = "dashboard"
"""Name of the link, and beginning of its fields."""

CommandName: TypeAlias = Literal["play", "stop", "pause", "load", "unlock", "power", "brake_release"]
StateName: TypeAlias = Literal[
    "robot_mode", "program_state", "loaded", "safety_status", "remote_control", "result", "connected"
]

VERBS: Final[Mapping[str, Verb]] = {
    "play": Verb.PLAY,
    "stop": Verb.STOP,
    "pause": Verb.PAUSE,
    "load": Verb.LOAD,
    "unlock": Verb.UNLOCK,
    "power": Verb.POWER_ON,
    "brake_release": Verb.BRAKE_RELEASE,
}
"""Commands by their names in a mapping."""
POWERFUL: Final = frozenset({"unlock", "power", "brake_release"})
"""What prepares the robot to move: only one writer may do it."""
MOVING: Final = frozenset({"play", *POWERFUL})
"""What may set the robot in motion, now or as the next step."""
STATES: Final[Mapping[str, ValueKind]] = {
    "robot_mode": ValueKind.INT,
    "program_state": ValueKind.INT,
    "loaded": ValueKind.INT,
    "safety_status": ValueKind.INT,
    "remote_control": ValueKind.BOOL,
    "result": ValueKind.INT,
    "connected": ValueKind.BOOL,
}
"""States by their names in a mapping."""
OWN: Final = frozenset({"result", "connected"})
"""States that the gateway knows by itself, connected or not."""
MODES: Final[Mapping[str, type[IntEnum]]] = {
    "robot_mode": RobotMode,
    "safety_status": SafetyStatus,
}
"""States whose words in the server's answers are the names of RTDE's numbers."""
PROGRAM_STATES: Final[Mapping[str, ProgramState]] = {
    "STOPPED": ProgramState.STOPPED,
    "PLAYING": ProgramState.RUNNING,
    "PAUSED": ProgramState.PAUSED,
}


def field_of(name: str) -> str:
    """The field of a command or state: `dashboard.play`."""
    return f"{VIA}.{name}"


def name_of(field: str) -> str:
    """The command or state of a field."""
    return field.removeprefix(f"{VIA}.")


def meanings_of(name: str) -> Mapping[int, str]:
    """What the numbers of a state mean; empty where they mean themselves."""
    if name == "result":
        return {int(result): words for result, words in WORDS.items()}
    if name == "program_state":
        return {
            int(state): MEANINGS["runtime_state"][int(state)] for state in sorted(PROGRAM_STATES.values())
        }
    return MEANINGS.get(name, {})
