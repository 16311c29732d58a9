"""References to fields and versions of the software as a mapping writes them."""

from __future__ import annotations

import pytest

from gatewayd.links.robot.scalars import RobotReference, Version
from tests.mapping.values import read, refused


def test_references() -> None:
    one = read(RobotReference, "input_int_register_0")
    assert (one.field, one.registers, one.many) == ("input_int_register_0", None, False)
    family = read(RobotReference, "output_double_register_0..23")
    assert (family.field, family.registers, family.many) == ("output_double_register_", range(24), True)
    element = read(RobotReference, "'actual_TCP_pose[2]'")
    assert (element.field, element.elements, element.many) == ("actual_TCP_pose", range(2, 3), False)
    bits = read(RobotReference, "actual_digital_input_bits.0..7")
    assert (bits.field, bits.bits, bits.many) == ("actual_digital_input_bits", range(8), True)


@pytest.mark.parametrize(
    "text, slug",
    [
        ("5", "bad-robot-reference"),
        ("'x[a]'", "bad-robot-reference"),
        ("x..3", "bad-robot-reference"),
        ("'x[0..1].0..3'", "bad-robot-reference"),
        ("a b", "bad-robot-reference"),
        ("x_7..3", "bad-range"),
        ("[x]", "wrong-type"),
    ],
)
def test_refused_references(text: str, slug: str) -> None:
    assert refused(RobotReference, text)[0] == slug


@pytest.mark.parametrize(
    "text, version",
    [("5.12", (5, 12, 0)), ("5.10", (5, 10, 0)), ("10", (10, 0, 0)), ("'5.9.4.1031110'", (5, 9, 4))],
)
def test_versions(text: str, version: tuple[int, int, int]) -> None:
    """5.10 is version ten, not one."""
    assert read(Version, text) == version
