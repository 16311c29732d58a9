"""What a `robot:` reference means."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.robot.reference import ReferenceProblem, UnresolvedReference, resolve
from gatewayd.links.robot.scalars import Reference, RobotReference
from gatewayd.mapping import tables
from gatewayd.rtde.fields import INPUTS, OUTPUTS


def read(text: str) -> Reference:
    reference = tables.read(RobotReference, text)
    assert isinstance(reference, Reference)
    return reference


@pytest.mark.parametrize(
    "reference, targets",
    [
        ("input_bit_register_63", [("input_bit_registers32_to_63", 31, None)]),
        ("input_bit_register_64", [("input_bit_register_64", None, None)]),
        (
            "output_bit_register_31..32",
            [("output_bit_registers0_to_31", 31, None), ("output_bit_registers32_to_63", 0, None)],
        ),
        ("output_int_register_0..1", [(f"output_int_register_{n}", None, None) for n in (0, 1)]),
        ("actual_tool_accelerometer", [("actual_tool_accelerometer", None, n) for n in (0, 1, 2)]),
        ("actual_TCP_pose[5]", [("actual_TCP_pose", None, 5)]),
        ("actual_TCP_pose[0..1]", [("actual_TCP_pose", None, 0), ("actual_TCP_pose", None, 1)]),
        ("actual_digital_input_bits.3", [("actual_digital_input_bits", 3, None)]),
        ("robot_status_bits.0..1", [("robot_status_bits", 0, None), ("robot_status_bits", 1, None)]),
        ("input_bit_registers0_to_31", [("input_bit_registers0_to_31", None, None)]),
    ],
)
def test_references(reference: str, targets: list[tuple[str, int | None, int | None]]) -> None:
    """Field, bit and element of each variable; bits 0 to 63 are bits of the words that RTDE has."""
    found = resolve(read(reference))
    assert [(target.field.name, target.bit, target.element) for target in found] == targets


@pytest.mark.parametrize(
    "reference, problem, name, limit",
    [
        ("actual_TCP_pos", ReferenceProblem.UNKNOWN_FIELD, "actual_TCP_pos", None),
        ("input_int_register_07", ReferenceProblem.UNKNOWN_FIELD, "input_int_register_07", None),
        ("robot_mode_0..3", ReferenceProblem.NOT_NUMBERED, "robot_mode_", None),
        ("input_int_register_40..50", ReferenceProblem.NO_SUCH_REGISTER, "input_int_register_48", 47),
        ("input_bit_register_128", ReferenceProblem.NO_SUCH_REGISTER, "input_bit_register_128", 127),
        ("robot_mode[0]", ReferenceProblem.NOT_A_VECTOR, "robot_mode", None),
        ("actual_q[6]", ReferenceProblem.NO_SUCH_ELEMENT, "actual_q", 6),
        ("speed_scaling.0", ReferenceProblem.NOT_AN_INTEGER, "speed_scaling", None),
        ("robot_mode.32", ReferenceProblem.NO_SUCH_BIT, "robot_mode", 32),
    ],
)
def test_references_to_nothing(
    reference: str, problem: ReferenceProblem, name: str, limit: int | None
) -> None:
    """The refusal says which name is wrong and what there is."""
    with pytest.raises(UnresolvedReference) as caught:
        resolve(read(reference))
    assert (caught.value.problem, caught.value.name, caught.value.limit) == (problem, name, limit)


@pytest.mark.parametrize("name", ["input_int_register_" + "9" * 5000, "x" + "0" * 5000])
def test_endless_names_are_just_unknown(name: str) -> None:
    """Python refuses to read integers of thousands of digits; nobody asks it to."""
    with pytest.raises(UnresolvedReference):
        resolve(read(name))


@given(st.sampled_from(sorted({*INPUTS, *OUTPUTS})))
def test_every_field_of_the_catalogue_can_be_named(name: str) -> None:
    """A vector gives all its elements, everything else itself."""
    targets = resolve(read(name))
    assert len(targets) == targets[0].field.type.count
    assert {target.field.name for target in targets} == {name}
    assert not any(target.type.is_vector for target in targets)
