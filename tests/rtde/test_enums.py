from __future__ import annotations

from enum import IntEnum
from pathlib import Path

import pytest

from gatewayd.rtde import enums

REFERENCE = Path(__file__).parents[2] / "docs/reference/rtde.md"


@pytest.mark.parametrize(
    "member, number",
    [
        (enums.RobotMode.RUNNING, 7),
        (enums.RobotMode.ARM_UPDATING, 11),
        (enums.SafetyStatus.FAULT, 9),
        (enums.SafetyStatus.SAFETY_API_SAFEGUARD_STOP, 22),
        (enums.JointMode.READY_FOR_POWER_OFF, 240),
        (enums.JointMode.IDLE, 255),
        (enums.ProgramState.RETRACTING, 6),
        (enums.TimeScaleSource.OTHER, -1),
        (enums.TimeScaleSource.EXTERNAL_AXIS_STOPPING, 15),
    ],
)
def test_numbers_are_the_guides(member: int, number: int) -> None:
    assert member == number


@pytest.mark.parametrize(
    "enum, members",
    [
        (enums.RobotMode, 13),
        (enums.SafetyStatus, 21),
        (enums.JointMode, 13),
        (enums.ProgramState, 7),
        (enums.TimeScaleSource, 17),
    ],
)
def test_every_listed_value_has_a_name(enum: type, members: int) -> None:
    assert len(list(enum)) == members  # type: ignore[call-overload]


@pytest.mark.parametrize(
    "field, enum",
    [
        ("robot_mode", enums.RobotMode),
        ("safety_status", enums.SafetyStatus),
        ("joint_mode", enums.JointMode),
        ("runtime_state", enums.ProgramState),
        ("time_scale_source", enums.TimeScaleSource),
        ("safety_mode", enums.SafetyMode),
        ("tool_mode", enums.ToolMode),
    ],
)
def test_the_field_reference_lists_every_value(field: str, enum: type[IntEnum]) -> None:
    text = REFERENCE.read_text().partition("## Modes, states and status bits")[2]
    (row,) = (line for line in text.splitlines() if line.startswith(f"| `{field}` |"))
    listed = row.split("|")[2].strip()
    assert listed == ", ".join(f"{number} {words}" for number, words in enums.MEANINGS[field].items())
    assert list(enums.MEANINGS[field]) == list(enum)


@pytest.mark.parametrize("field, bits", [("robot_status_bits", 4), ("safety_status_bits", 12)])
def test_the_field_reference_lists_every_status_bit(field: str, bits: int) -> None:
    text = REFERENCE.read_text().partition("## Modes, states and status bits")[2]
    (row,) = (line for line in text.splitlines() if line.startswith(f"| `{field}` |"))
    words = enums.BITS[field]
    assert row.split("|")[2].strip() == "bits: " + ", ".join(
        f"{bit} {said.on}" for bit, said in words.items()
    )
    assert list(words) == list(range(bits))


@pytest.mark.parametrize(
    "field, bit, words",
    [
        ("robot_mode", None, {7: "running"}),
        ("safety_status_bits", 2, {0: "not protective stopped", 1: "protective stopped"}),
        ("robot_status_bits", 0, {0: "power off", 1: "power on"}),
    ],
)
def test_numbers_and_single_bits_have_words(field: str, bit: int | None, words: dict[int, str]) -> None:
    found = enums.meanings(field, bit)
    assert {number: found[number] for number in words} == words


@pytest.mark.parametrize(
    "field, bit",
    [
        ("safety_status_bits", 31),
        ("safety_status_bits", None),
        ("output_bit_registers0_to_31", 0),
        ("actual_q", None),
    ],
)
def test_what_stands_for_itself_has_none(field: str, bit: int | None) -> None:
    assert not enums.meanings(field, bit)
