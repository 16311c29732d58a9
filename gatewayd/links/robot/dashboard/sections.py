"""The dashboard server in a mapping file: `robot: dashboard:`, and `dashboard:` of a variable."""

from __future__ import annotations

from typing import Annotated

from gatewayd.dashboard.requests import DEFAULT_PORT, is_program
from gatewayd.links.robot.dashboard.variables import CommandName, StateName
from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import declare
from gatewayd.mapping.scalars import Duration, Whole, refuse, scalar
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import BeforeValidator, Field

MAX_NUMBER = 255
"""Of a program."""
PERIOD = 0.5
"""Seconds between two rounds of questions where the file says nothing."""

BAD_PROGRAM = declare(
    "GW850",
    "bad-program-name",
    "a name of a robot program that cannot be sent to the dashboard server",
    home="gatewayd.links.robot.dashboard.rules",
)


def _number(value: object) -> str:
    hint = f"number programs from 1 to {MAX_NUMBER}; 0 is no program"
    text = scalar(value, "the number of a program", hint)
    if not (text.isascii() and text.isdecimal() and str(int(text)) == text and 1 <= int(text) <= MAX_NUMBER):
        refuse(syntax.BAD_NUMBER, f"`{text}` is not the number of a program", hint)
    return text


def _program(value: object) -> str:
    hint = "write the file as the pendant shows it, below its programs: pick.urp or cell3/pick.urp"
    text = scalar(value, "the name of a program", hint)
    if not is_program(text):
        refuse(BAD_PROGRAM, f"{text!r} is not the name of a robot program", hint)
    return text


ProgramNumber = Annotated[
    str,
    BeforeValidator(_number, json_schema_input_type=Annotated[str, Field(pattern="^[1-9][0-9]{0,2}$")]),
]
"""Number by which a PLC asks for a program."""
ProgramName = Annotated[
    str,
    BeforeValidator(
        _program,
        json_schema_input_type=Annotated[
            str, Field(pattern="^[!-~]([ -~]{0,253}[!-~])?$", examples=["pick.urp"])
        ],
    ),
]
"""File of a program, below those of the controller."""


class DashboardSection(Section):
    """The dashboard server of a CB3 or e-Series controller."""

    port: Whole = Field(default=DEFAULT_PORT, ge=1, le=65535, description="TCP port of the dashboard server")
    poll: Duration = Field(
        default=PERIOD,
        ge=0.1,
        le=60,
        description="time between two rounds of questions for the robot's state",
    )
    programs: dict[ProgramNumber, ProgramName] = Field(
        default_factory=dict, description="programs that `load` can load, by number: {1: pick.urp}"
    )


class DashboardPlace(Section):
    """What a variable is in the dashboard server."""

    dashboard: CommandName | StateName | None = Field(
        default=None,
        description="in place of `robot`: a command (play, stop, pause, load, unlock, power, brake_release) or a state "
        "(robot_mode, program_state, loaded, safety_status, remote_control, result, connected)",
    )
