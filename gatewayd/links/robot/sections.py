"""The section `robot` of a mapping file: the controller and what is asked of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from gatewayd.links.robot.dashboard.sections import DashboardPlace, DashboardSection
from gatewayd.links.robot.scalars import RobotReference, Version
from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import Duration, Host, Name, Names, OptionalDuration, Real, Whole, refuse
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import BeforeValidator, Field
from gatewayd.rtde.types import DEFAULT_PORT

FieldType = Literal[
    "BOOL", "UINT8", "UINT32", "UINT64", "INT32", "DOUBLE",
    "VECTOR3D", "VECTOR6D", "VECTOR6INT32", "VECTOR6UINT32",
]  # fmt: skip
"""The type words of RTDE."""

ADOPT_FOR = 10.0
"""Seconds that an adopted input waits for an owner where the file says nothing."""


class Watchdog(Section):
    """Feeding of the robot-side watchdog."""

    field: Name = Field(
        description="RTDE input register that is fed; named in rtde_set_watchdog of the robot program"
    )
    frequency: Real = Field(default=10.0, gt=0, le=500, description="feeds per second")
    requires: Names | None = Field(
        default=None, description="writers that must be alive for the feeding to go on; default: none"
    )


class RobotSection(Section):
    """The controller and what is asked of it."""

    host: Host = Field(description="name or IP address of the controller")
    port: Whole = Field(default=DEFAULT_PORT, ge=1, le=65535, description="TCP port of RTDE")
    series: Literal["cb3", "e", "x"] | None = Field(
        default=None, description="controller series; lets `check` know base rate and fields"
    )
    version: Version | None = Field(
        default=None,
        description="controller software, for example 5.12; lets `check` know which fields exist",
    )
    frequency: Real = Field(
        default=0.0, ge=0, le=500, description="packages per second, Hz; 0: the controller's own rate"
    )
    stale_after: Duration | None = Field(
        default=None,
        description="time without a fresh package after which outputs are stale; default: 5 periods, at least 100ms",
    )
    on_connect: Literal["adopt", "fallback"] = Field(
        default="adopt",
        description="inputs without an owner after connecting: keep what the controller holds, or give on_release",
    )
    adopt_for: OptionalDuration = Field(
        default=ADOPT_FOR,
        description="how long an adopted input waits for an owner, counted once from the start, before it takes "
        "on_release; none: for ever",
    )
    verify: bool = Field(
        default=True,
        description="read inputs back all the time and compare them with what was written; false: only when connecting",
    )
    valid: Literal["running"] | None = Field(
        default=None,
        description="running: the output registers (`output_*`) are good only while the robot program runs",
    )
    watchdog: Watchdog | None = Field(default=None, description="register that is fed while all is well")
    dashboard: DashboardSection | None = Field(
        default=None,
        description="the dashboard server of CB3 and e-Series controllers, by which variables start programs; default: "
        "it is not used",
    )


class RobotField(Section):
    """A field with what is known of it beyond the catalogue."""

    field: RobotReference = Field(description="RTDE field, or anything else that `robot:` can name")
    type: FieldType | None = Field(
        default=None,
        description="type that the controller gives it, if the catalogue does not have the field, or has another type",
    )
    direction: Literal["input", "output"] | None = Field(
        default=None,
        description="direction, if the catalogue does not have the field; default: input for input_*, else output",
    )


def _field(value: Any) -> Any:
    """Bring the short form into the long one."""
    return value if isinstance(value, dict | RobotField) else {"field": value}


class RobotPlace(Section):
    """What a variable is in the robot."""

    schema_extra: ClassVar[Mapping[str, Any]] = {
        "oneOf": [{"required": ["robot"]}, {"required": ["dashboard"]}]
    }

    robot: Annotated[
        RobotField | None, BeforeValidator(_field, json_schema_input_type=RobotReference | RobotField)
    ] = Field(
        default=None,
        description="RTDE field, 'field[element]', field.bit, a range of registers such as output_int_register_0..23, "
        "or {field: ..., type: ...} for one that the catalogue does not have",
    )

    @property
    def field(self) -> RobotField:
        """The field of a variable that packages carry."""
        assert self.robot is not None
        return self.robot

    def judge(self) -> None:
        """A variable is one thing in the robot."""
        dashboard = self.by(DashboardPlace).dashboard
        if self.robot is None and dashboard is None:
            refuse(syntax.MISSING_KEY, "a variable needs the key `robot` or `dashboard`", _WHAT_IT_IS)
        if self.robot is not None and dashboard is not None:
            message = (
                f"a variable is either `robot: {self.robot.field}` or `dashboard: {dashboard}`, not both"
            )
            refuse(syntax.UNKNOWN_KEY, message, "remove one of the two, or make two variables of it")


_WHAT_IT_IS = (
    "`robot`: an RTDE field such as input_bit_register_0; `dashboard`: a command or state such as play"
)


class RobotValidity(Section):
    """When a variable of the robot is good."""

    valid: Literal["running"] | None = Field(
        default=None,
        description="outputs: running makes it good only while the robot program runs; default: always",
    )
