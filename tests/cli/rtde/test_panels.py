"""What is drawn of a recording, and where."""

from __future__ import annotations

import pytest

from gatewayd.cli.rtde.panels import chosen, panels, together
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording import columns

NAMES = (
    "timestamp",
    "target_q",
    "actual_q",
    "actual_TCP_pose",
    "elbow_position",
    "runtime_state",
    "output_int_register_0",
)
RECIPE = Recipe(NAMES, [OUTPUTS[name].type for name in NAMES])


@pytest.mark.parametrize(
    "wanted, expected",
    [
        (["runtime_state"], ["runtime_state"]),
        (["elbow_position"], [f"elbow_position_{element}" for element in range(3)]),
        (["actual_q[1]"], ["actual_q_1"]),
        (["actual_q_1"], ["actual_q_1"]),
        (["actual_q[4]", "actual_q[4]"], ["actual_q_4"]),
        (["*_q"], [f"{side}_q_{element}" for side in ("target", "actual") for element in range(6)]),
        (["*_q_0"], ["target_q_0", "actual_q_0"]),
    ],
)
def test_names_elements_and_patterns(wanted: list[str], expected: list[str]) -> None:
    assert chosen(RECIPE, wanted) == (tuple(expected), ())


@pytest.mark.parametrize("wish", ["actual_q[6]", "q", "x_*", ""])
def test_what_means_nothing_is_named(wish: str) -> None:
    assert chosen(RECIPE, ["runtime_state", wish]) == (("runtime_state",), (wish,))


def test_without_a_wish_it_is_everything_but_the_time() -> None:
    assert chosen(RECIPE, ()) == (columns(RECIPE)[1:], ())


def test_each_joint_and_each_axis_has_its_panel_and_its_unit() -> None:
    found = panels(RECIPE, columns(RECIPE)[1:])
    assert [panel.label for panel in found] == [
        *(f"q, {joint} in rad" for joint in ("base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3")),
        *(f"actual_TCP_pose, {axis} in m" for axis in "xyz"),
        *(f"actual_TCP_pose, {axis} in rad" for axis in ("rx", "ry", "rz")),
        *(f"elbow_position, {axis}" for axis in "xyz"),
        "runtime_state",
        "output_int_register_0",
    ]


def test_target_and_actual_share_a_panel_where_both_are_drawn() -> None:
    (shoulder,) = panels(RECIPE, ["target_q_1", "actual_q_1"])
    assert [(curve.field, curve.column) for curve in shoulder.curves] == [
        ("target_q", "target_q_1"),
        ("actual_q", "actual_q_1"),
    ]
    assert panels(RECIPE, ["actual_q_1"])[0].title == "actual_q, shoulder"


def test_fields_of_several_recordings_are_there_once() -> None:
    other = Recipe(["payload", "actual_q"], [OUTPUTS["payload"].type, OUTPUTS["actual_q"].type])
    assert together([RECIPE, other]).names == (*NAMES, "payload")


def test_integers_are_stepped() -> None:
    drawn = panels(RECIPE, ["runtime_state", "actual_q_0"])
    assert [curve.stepped for panel in drawn for curve in panel.curves] == [False, True]


def test_units_of_the_guides_come_first() -> None:
    recipe = Recipe(["actual_TCP_speed", "joint_temperatures"], [OUTPUTS["actual_TCP_speed"].type] * 2)
    units = [panel.unit for panel in panels(recipe, columns(recipe))]
    assert units == ["m/s"] * 3 + ["rad/s"] * 3 + ["°C"] * 6
