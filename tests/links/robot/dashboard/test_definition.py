"""What variables of the dashboard server are."""

from __future__ import annotations

from gatewayd.core.definition import Direction, ValueKind
from gatewayd.links.robot.dashboard.definition import defined
from gatewayd.links.robot.dashboard.sections import DashboardSection
from gatewayd.links.robot.dashboard.variables import STATES, VERBS


def test_commands_are_inputs_and_states_outputs() -> None:
    for name in VERBS:
        found = defined(name, None)
        assert (found.direction, found.via, found.field) == (
            Direction.INPUT,
            "dashboard",
            f"dashboard.{name}",
        )
    for name, kind in STATES.items():
        found = defined(name, None)
        assert (found.direction, found.via, found.kind) == (Direction.OUTPUT, "dashboard", kind)


def test_a_program_is_a_number_that_the_file_has() -> None:
    load = defined("load", DashboardSection(programs={"1": "a.urp", "9": "b.urp"}))
    assert (load.kind, load.low, load.high) == (ValueKind.INT, 0, 9)
    assert (defined("load", None).high, defined("loaded", None).high) == (0, 0)


def test_what_may_set_the_robot_in_motion_says_so() -> None:
    assert [name for name in VERBS if defined(name, None).moves] == [
        "play", "unlock", "power", "brake_release",
    ]  # fmt: skip


def test_states_have_the_range_of_their_fields() -> None:
    assert defined("robot_mode", None).usual == (-1, 255)
    assert defined("result", None).high == 18
