"""What a line of a mapping means in the robot."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import ValueKind
from gatewayd.links.robot.definition import field_of, is_program_output
from gatewayd.mapping.expanded import ExpandedVariable
from gatewayd.mapping.loader import load


def defined(*lines: str) -> tuple[ExpandedVariable, ...]:
    text = "gatewayd: 1\ncell: c\nrobot: {host: r}\nvariables:\n" + "".join(f"  {line}\n" for line in lines)
    return load(text.encode(), "cell.yaml").cell.variables


def test_kinds_and_ranges_follow_the_robots_type() -> None:
    variables = defined(
        "a: {robot: output_int_register_0}",
        "b: {robot: output_double_register_0}",
        "c: {robot: output_bit_register_0}",
        "d: {robot: actual_digital_input_bits}",
    )
    assert [(variable.kind, variable.low, variable.high) for variable in variables] == [
        (ValueKind.INT, -(1 << 31), (1 << 31) - 1),
        (ValueKind.FLOAT, None, None),
        (ValueKind.BOOL, None, None),
        (ValueKind.INT, 0, (1 << 64) - 1),
    ]


@pytest.mark.parametrize(
    "reference, counterpart, by_program",
    [
        ("output_int_register_5", "input_int_register_5", True),
        ("target_speed_fraction", "speed_slider_fraction (with its mask)", False),
        ("robot_mode", "input_int_register_0", False),
        ("input_int_register_3", "", False),
    ],
)
def test_counterparts_of_outputs(reference: str, counterpart: str, by_program: bool) -> None:
    """What would be written in the place of what is read."""
    (variable,) = defined(f"a: {{robot: {reference}}}")
    assert (variable.counterpart, is_program_output(variable)) == (counterpart, by_program)
    assert field_of(variable).name == reference


def test_what_is_known_of_single_fields() -> None:
    """Enumerations are small, the time grows, the slider moves the robot."""
    mode, time, slider = defined(
        "a: {robot: robot_mode}", "b: {robot: timestamp}", "c: {robot: speed_slider_fraction}"
    )
    assert (mode.range, mode.grows, mode.moves) == ((-1, 255), False, False)
    assert (time.grows, slider.moves) == (True, True)
