"""The mapping language, version 1, as typed models. The JSON Schema is generated from them.

Defaults that hang on other parts of a file (the lease of a list, the type of a register) are worked out by
`expand`; here such a key is None, and `model_fields_set` tells whether it was written.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from gatewayd.core.definition import Fallback
from gatewayd.links.canopen_node.scalars import MillisecondTime
from gatewayd.links.canopen_node.sections import Canopen, Place
from gatewayd.links.modbus_server.sections import Modbus, PlacementSpec, modbus_places
from gatewayd.links.robot.sections import Robot
from gatewayd.mapping.rules import syntax
from gatewayd.mapping.scalars import (
    CellName,
    Name,
    Names,
    Networks,
    OptionalDuration,
    OutputPolicy,
    Real,
    ReleasePolicy,
    RobotReference,
    Whole,
    refuse,
)
from gatewayd.mapping.section import Section

__all__ = [
    "ANY",
    "FORMAT_VERSION",
    "Group",
    "MappingFile",
    "VariableSpec",
    "WriterSpec",
]

FORMAT_VERSION = 1
"""Version of the mapping language that this module describes."""
ANY = "any"
"""The owner that stands for every writer; no writer can have this name."""


class WriterSpec(Section):
    """A party that may write inputs."""

    model_config = ConfigDict(
        json_schema_extra={"anyOf": [{"required": ["modbus"]}, {"required": ["canopen"]}]}
    )

    modbus: Networks = Field(
        default=(), description="address or network of the Modbus client, or a list of them"
    )
    canopen: Literal["rpdo", "sdo", "any"] | None = Field(
        default=None, description="services of the CANopen node by which it writes: rpdo, sdo, or any (both)"
    )
    node: Whole | None = Field(
        default=None, ge=1, le=127, description="node-ID whose heartbeat tells whether it lives (CANopen)"
    )
    heartbeat: MillisecondTime = Field(
        default=None,
        description="time without a heartbeat of `node`, from the writer's first sign on, after which it is lost "
        "and writes nothing by CANopen until it is heard",
    )
    timeout: OptionalDuration = Field(
        default=None,
        description="time without any request after which the writer counts as lost; default: none",
    )
    timeout_counts: Literal["requests", "writes"] = Field(
        default="requests",
        description="what feeds `timeout`: every request, or only writes and lock requests",
    )
    grace: OptionalDuration = Field(
        default=None,
        description="how long what it owns outlives a connection that ended; default: none",
    )

    @model_validator(mode="after")
    def _some_link(self) -> Self:
        if not self.modbus and self.canopen is None:
            refuse(
                syntax.MISSING_KEY,
                "a writer needs the key `modbus` or `canopen`, by which it is known",
                "add for example `modbus: 192.168.1.20` or `canopen: rpdo`",
            )
        return self

    @property
    def by_rpdo(self) -> bool:
        """Whether RPDOs are this writer's."""
        return self.canopen in ("rpdo", "any")

    @property
    def by_sdo(self) -> bool:
        """Whether SDO requests are this writer's."""
        return self.canopen in ("sdo", "any")

    @property
    def is_supervised(self) -> bool:
        """Whether it is noticed when it hangs, be its connection open or not."""
        return self.timeout is not None or (self.heartbeat is not None and not self.modbus)


class Group(Section):
    """Input variables that are only ever owned together."""

    owner: Names | None = Field(
        default=None, description="writers by priority, first is highest; or any (default)"
    )
    lease: OptionalDuration = Field(default=None, description="how long the owner keeps it without writing")
    takeover: bool | None = Field(
        default=None, description="whether a writer named earlier takes it over; default: yes for a list"
    )
    whole: bool = Field(
        default=False, description="refuse a takeover that does not write every variable of the group"
    )
    comment: str = Field(default="", max_length=500, description="for people")


class VariableSpec(Section):
    """One variable, or a family of variables on one line."""

    robot: RobotReference = Field(
        description="RTDE field, 'field[element]', field.bit, or a range of registers such as output_int_register_0..23"
    )
    modbus: Annotated[
        tuple[PlacementSpec, ...],
        BeforeValidator(
            modbus_places,
            json_schema_input_type=float | str | PlacementSpec | list[float | str | PlacementSpec],
        ),
        Field(strict=False),
    ] = Field(
        default=(),
        description="address from 0 (100), bit of a register (100.3), {area: address, type: ...}, or a list of these",
    )
    canopen: Place | None = Field(
        default=None, description="auto, object (no PDO), or {pdo: NAME, type: ...}; default: not on CANopen"
    )
    owner: Names | None = Field(
        default=None, description="writers by priority, first is highest; or any (default, first come)"
    )
    takeover: bool | None = Field(
        default=None, description="whether a writer named earlier takes it over; default: yes for a list"
    )
    lease: OptionalDuration = Field(
        default=None,
        description="how long an owner keeps it without writing; default: none for one owner, 5s for a list and any",
    )
    group: Name | None = Field(default=None, description="group that it is owned with")
    limits: Annotated[tuple[Real, Real], Field(strict=False)] | None = Field(
        default=None, description="least and greatest value in the robot's unit"
    )
    clamp: bool = Field(
        default=False, description="bring values outside the limits to the limit instead of refusing"
    )
    on_release: ReleasePolicy = Field(
        default=Fallback(),
        description="inputs: clear (default), hold, or a value given when the owner is lost",
        json_schema_extra={"default": "clear"},
    )
    on_stale: OutputPolicy = Field(
        default=Fallback(),
        description="outputs: clear (default), hold, exception, or a value seen when the robot is lost",
        json_schema_extra={"default": "clear"},
    )
    valid: Literal["running"] | None = Field(
        default=None,
        description="outputs: running makes it good only while the robot program runs; default: always",
    )
    deadband: Real = Field(default=0.0, ge=0, description="least change that makes an event-driven PDO send")
    unit: str = Field(default="", max_length=32, description="unit of the robot's value, for people")
    comment: str = Field(default="", max_length=500, description="for people")


class MappingFile(Section):
    """A mapping of gatewayd: one robot cell."""

    gatewayd: Annotated[
        Literal[1], BeforeValidator(lambda value: value, json_schema_input_type=Literal[1])
    ] = Field(description="version of the mapping language")
    cell: CellName = Field(description="name of the cell")
    robot: Robot = Field(description="the controller")
    modbus: Modbus | None = Field(default=None, description="the Modbus TCP server")
    canopen: Canopen | None = Field(default=None, description="the CANopen node")
    writers: dict[Name, WriterSpec] = Field(default_factory=dict, description="who may write inputs")
    groups: dict[Name, Group] = Field(default_factory=dict, description="variables that are owned together")
    variables: dict[Name, VariableSpec] = Field(description="the variables by name")
