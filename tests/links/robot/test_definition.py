"""What a line of a mapping means in the robot."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.robot.definition import field_of, is_program_output, type_of
from gatewayd.mapping.expanded import ExpandedVariable
from gatewayd.mapping.loader import load
from gatewayd.rtde.types import DataType


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
        ("input_int_register_3", "output_int_register_3", False),
    ],
)
def test_counterparts(reference: str, counterpart: str, by_program: bool) -> None:
    """What would be written in the place of what is read, and read in the place of what is written."""
    (variable,) = defined(f"a: {{robot: {reference}}}")
    assert (variable.counterpart, is_program_output(variable)) == (counterpart, by_program)
    field = field_of(variable)
    assert field is not None
    assert field.name == reference


def test_a_declared_type_makes_a_field_usable_that_the_catalogue_does_not_have() -> None:
    scalar, x, y, bit, register, given = defined(
        "a: {robot: {field: dexterity, type: DOUBLE}}",
        "b: {robot: {field: 'new_pose[0..1]', type: VECTOR6D}}",
        "c: {robot: {field: new_bits.3, type: UINT32}}",
        "d: {robot: {field: output_int_register_48, type: INT32}}",
        "e: {robot: {field: new_setting, type: UINT8, direction: input}}",
    )
    assert (scalar.kind, scalar.direction, scalar.field, field_of(scalar)) == (
        ValueKind.FLOAT,
        Direction.OUTPUT,
        "dexterity",
        None,
    )
    assert [(one.target, one.element, one.type) for one in (x, y)] == [
        ("new_pose[0]", 0, "DOUBLE"),
        ("new_pose[1]", 1, "DOUBLE"),
    ]
    assert (bit.kind, bit.bit, type_of(bit)) == (ValueKind.BOOL, 3, DataType.UINT32)
    assert (register.kind, register.direction) == (ValueKind.INT, Direction.OUTPUT)
    assert (given.direction, given.low, given.high) == (Direction.INPUT, 0, 255)


def test_a_declared_type_goes_before_the_catalogues() -> None:
    mode, plain, word, longer = defined(
        "a: {robot: {field: robot_mode, type: UINT8}}",
        "b: {robot: robot_mode}",
        "c: {robot: {field: input_bit_register_5, type: BOOL}}",
        "d: {robot: {field: 'actual_tool_accelerometer[5]', type: VECTOR6D}}",
    )
    assert (longer.element, longer.usual) == (5, None)
    assert (mode.low, mode.high, type_of(mode)) == (0, 255, DataType.UINT8)
    assert (plain.low, type_of(plain)) == (-(1 << 31), None)
    assert (word.field, word.bit, type_of(word)) == ("input_bit_registers0_to_31", 5, None)


def test_what_is_known_of_single_fields() -> None:
    """Enumerations are small, the time grows, the slider moves the robot."""
    mode, time, slider = defined(
        "a: {robot: robot_mode}", "b: {robot: timestamp}", "c: {robot: speed_slider_fraction}"
    )
    assert (mode.range, mode.grows, mode.moves) == ((-1, 255), False, False)
    assert (time.grows, slider.moves) == (True, True)
