from __future__ import annotations

import pytest

from gatewayd.rtde import enums


@pytest.mark.parametrize(
    "member, number",
    [
        (enums.RobotMode.RUNNING, 7),
        (enums.RobotMode.ARM_UPDATING, 11),
        (enums.SafetyStatus.FAULT, 9),
        (enums.SafetyStatus.SAFETY_API_SAFEGUARD_STOP, 22),
        (enums.SafetyMode.VIOLATION, 8),
        (enums.JointMode.READY_FOR_POWER_OFF, 240),
        (enums.JointMode.IDLE, 255),
        (enums.ProgramState.RETRACTING, 6),
        (enums.TimeScaleSource.OTHER, -1),
        (enums.TimeScaleSource.EXTERNAL_AXIS_STOPPING, 15),
        (enums.ToolMode.RUNNING, 253),
        (enums.ToolOutputMode.POWER, 1),
        (enums.ToolDigitalOutputMode.PUSH_PULL, 3),
    ],
)
def test_numbers_are_the_guides(member: int, number: int) -> None:
    assert member == number


@pytest.mark.parametrize(
    "enum, members",
    [
        (enums.RobotMode, 13),
        (enums.SafetyStatus, 19),
        (enums.JointMode, 13),
        (enums.ProgramState, 7),
        (enums.TimeScaleSource, 17),
    ],
)
def test_every_listed_value_has_a_name(enum: type, members: int) -> None:
    assert len(list(enum)) == members  # type: ignore[call-overload]


def test_status_bits_are_named_from_bit_0() -> None:
    assert enums.ROBOT_STATUS_BITS[1] == "program running"
    assert enums.SAFETY_STATUS_BITS[0] == "normal mode"
    assert enums.SAFETY_STATUS_BITS[10:] == ("stopped due to safety", "3PE input active")
