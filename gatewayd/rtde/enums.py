"""Meanings of the numbers in RTDE's mode, status and state fields; the field reference lists them for people.

From the newer guide (valid for 5.25.0, 10.12.0 and later, smaller sets before); values it does not list are reserved.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from types import MappingProxyType
from typing import NamedTuple


class RobotMode(IntEnum):
    """`robot_mode`."""

    NO_CONTROLLER = -1
    """Only named by UR's client library."""
    DISCONNECTED = 0
    CONFIRM_SAFETY = 1
    BOOTING = 2
    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    BACKDRIVE = 6
    RUNNING = 7
    UPDATING = 8
    POWERING_OFF = 9
    ARM_BOOTING = 10
    ARM_UPDATING = 11


class SafetyStatus(IntEnum):
    """`safety_status`."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9
    VALIDATE_JOINT_ID = 10
    """This and the next one are only named by UR's client library."""
    UNDEFINED = 11
    AUTOMATIC_MODE_SAFEGUARD_STOP = 12
    SYSTEM_THREE_POSITION_ENABLING_STOP = 13
    TP_THREE_POSITION_ENABLING_STOP = 14
    IMMI_EMERGENCY_STOP = 15
    IMMI_SAFEGUARD_STOP = 16
    PROFISAFE_WAITING_FOR_PARAMETERS = 17
    PROFISAFE_AUTOMATIC_MODE_SAFEGUARD_STOP = 18
    PROFISAFE_SAFEGUARD_STOP = 19
    PROFISAFE_EMERGENCY_STOP = 20
    SAFETY_API_SAFEGUARD_STOP = 22


class SafetyMode(IntEnum):
    """`safety_mode`, of Universal Robots' client library."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9
    VALIDATE_JOINT_ID = 10
    UNDEFINED = 11
    AUTOMATIC_MODE_SAFEGUARD_STOP = 12
    SYSTEM_THREE_POSITION_ENABLING_STOP = 13
    TP_THREE_POSITION_ENABLING_STOP = 14
    IMMI_EMERGENCY_STOP = 15
    IMMI_SAFEGUARD_STOP = 16
    PROFISAFE_WAITING_FOR_PARAMETERS = 17
    PROFISAFE_AUTOMATIC_MODE_SAFEGUARD_STOP = 18
    PROFISAFE_SAFEGUARD_STOP = 19
    PROFISAFE_EMERGENCY_STOP = 20
    SAFETY_API_SAFEGUARD_STOP = 22


class ToolMode(IntEnum):
    """`tool_mode`, of Universal Robots' client interface."""

    BOOTLOADER = 249
    RUNNING = 253
    IDLE = 255


class JointMode(IntEnum):
    """Each element of `joint_mode`."""

    RESET = 235
    SHUTTING_DOWN = 236
    BACKDRIVE = 238
    POWER_OFF = 239
    READY_FOR_POWER_OFF = 240
    NOT_RESPONDING = 245
    MOTOR_INITIALISATION = 246
    BOOTING = 247
    BOOTLOADER = 249
    VIOLATION = 251
    FAULT = 252
    RUNNING = 253
    IDLE = 255


class ProgramState(IntEnum):
    """`runtime_state`."""

    STOPPING = 0
    STOPPED = 1
    RUNNING = 2
    PAUSING = 3
    PAUSED = 4
    RESUMING = 5
    RETRACTING = 6


# Whether a program runs is asked for three reasons, and each needs another answer. What a program wrote is meant from
# RUNNING to RESUMING: `core.program` has that one, since a cell knows no bus; its test holds it against these.
PROGRAM_ADVANCES: frozenset[int] = frozenset({ProgramState.RUNNING})
"""The program goes through its lines: what the official reader's `filter_running_program` keeps of a recording."""
PROGRAM_IDLE: frozenset[int] = frozenset({ProgramState.STOPPED})
"""No program reads what it is given. A paused one goes on with what it finds then, and a stopping one still moves."""


class TimeScaleSource(IntEnum):
    """`time_scale_source`: what slows the motion down."""

    OTHER = -1
    PROGRAM_NOT_RUNNING = 0
    NOT_SCALED = 1
    JOINT_TORQUE_LIMIT = 2
    JOINT_ACCELERATION_LIMIT = 3
    POWER_SUPPLY_LIMIT = 4
    MOMENTUM_SAFETY_LIMIT = 5
    STOPPING_TIME_SAFETY_LIMIT = 6
    STOPPING_DISTANCE_SAFETY_LIMIT = 7
    TOOL_SPEED_SAFETY_LIMIT = 8
    ELBOW_SPEED_SAFETY_LIMIT = 9
    JOINT_SPEED_SAFETY_LIMIT = 10
    SAFETY_STATE_TRANSITION = 11
    SAFETY_API_STOPPING_DISTANCE = 12
    TOOL_WRENCH_LIMIT = 13
    EXTERNAL_AXIS_SPEED_LIMIT = 14
    EXTERNAL_AXIS_STOPPING = 15


_SPELLED = {"tp": "TP", "immi": "IMMI", "profisafe": "PROFIsafe", "api": "API"}


def _words(state: IntEnum) -> str:
    """`PROFIsafe safeguard stop`."""
    return " ".join(_SPELLED.get(word, word) for word in state.name.lower().split("_"))


STATES: Mapping[str, type[IntEnum]] = MappingProxyType(
    {
        "robot_mode": RobotMode,
        "safety_status": SafetyStatus,
        "safety_mode": SafetyMode,
        "joint_mode": JointMode,
        "tool_mode": ToolMode,
        "runtime_state": ProgramState,
        "time_scale_source": TimeScaleSource,
    }
)
"""Field -> the names of its numbers."""

MEANINGS: Mapping[str, Mapping[int, str]] = MappingProxyType(
    {
        field: MappingProxyType({int(state): _words(state) for state in states})
        for field, states in STATES.items()
    }
)
"""Field -> number -> what it means, in words."""


class BitWords(NamedTuple):
    """What one bit of a status word says."""

    on: str
    off: str


_STATUS_BITS = {
    "robot_status_bits": (
        BitWords("power on", "power off"),
        BitWords("program running", "program not running"),
        BitWords("teach button pressed", "teach button not pressed"),
        BitWords("power button pressed", "power button not pressed"),
    ),
    "safety_status_bits": (
        BitWords("normal mode", "not normal mode"),
        BitWords("reduced mode", "not reduced mode"),
        BitWords("protective stopped", "not protective stopped"),
        BitWords("recovery mode", "not recovery mode"),
        BitWords("safeguard stopped", "not safeguard stopped"),
        BitWords("system emergency stopped", "not system emergency stopped"),
        BitWords("robot emergency stopped", "not robot emergency stopped"),
        BitWords("emergency stopped", "not emergency stopped"),
        BitWords("violation", "no violation"),
        BitWords("fault", "no fault"),
        BitWords("stopped due to safety", "not stopped due to safety"),
        BitWords("3PE input active", "3PE input not active"),
    ),
}

BITS: Mapping[str, Mapping[int, BitWords]] = MappingProxyType(
    {field: MappingProxyType(dict(enumerate(words))) for field, words in _STATUS_BITS.items()}
)
"""Field -> bit -> what it says, where each bit is a state (both guides; bits that are not listed are reserved)."""


def meanings(field: str, bit: int | None) -> Mapping[int, str]:
    """What the numbers of a field mean, or 0 and 1 of one of its bits; empty where they mean themselves."""
    if bit is None:
        return MEANINGS.get(field, {})
    words = BITS.get(field, {}).get(bit)
    return {0: words.off, 1: words.on} if words is not None else {}
