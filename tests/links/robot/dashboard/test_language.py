"""The dashboard server in a mapping file."""

from __future__ import annotations

import pytest

from gatewayd.links.robot.dashboard.plan import DashboardPlan
from gatewayd.links.robot.plan import robot_of
from tests.links.robot.dashboard.cells import loaded, planned

PLAIN = "  bit: {robot: input_bit_register_0, modbus: 3.0, owner: plc}\n"


def findings(variables: str, dashboard: str = ", dashboard: {}") -> list[str]:
    return [found.message for found in loaded(variables, dashboard).diagnostics]


def test_the_section_makes_a_link_and_nothing_of_it_is_asked_of_packages() -> None:
    plan = planned()
    assert plan.the(DashboardPlan) == DashboardPlan(
        "127.0.0.1", 29999, 0.1, ((1, "pick.urp"), (2, "none.urp"))
    )
    assert robot_of(plan).inputs == ("input_bit_registers0_to_31",)
    assert robot_of(plan).outputs == ("target_speed_fraction",)


def test_without_the_section_there_is_no_link() -> None:
    assert list(planned(PLAIN, "").links) == ["robot", "modbus"]


def test_an_open_server_without_a_variable_has_no_effect() -> None:
    message = "the dashboard server is opened, and no variable is a command or a state of it"
    assert message in findings(PLAIN)


@pytest.mark.parametrize(
    "line, message",
    [
        ("{dashboard: jump, modbus: 0.0}", "`dashboard` is `jump`, but must be one of play, stop"),
        ("{modbus: 0.0}", "a variable needs the key `robot` or `dashboard`"),
        (
            "{robot: input_bit_register_0, dashboard: play, modbus: 0.0}",
            "a variable is either `robot: input_bit_register_0` or `dashboard: play`, not both",
        ),
        ("{dashboard: play}", "`x` (dashboard play) has no address on any fieldbus"),
        ("{dashboard: result, modbus: 0, valid: running}", "`valid` is for outputs that packages carry"),
        ("{dashboard: result, modbus: 0, owner: plc}", "`x` comes from the robot (dashboard.result)"),
    ],
)
def test_what_a_line_must_not_say(line: str, message: str) -> None:
    found = findings(f"  x: {line}\n")
    assert any(each.startswith(message) for each in found), found
