"""The mapping language, version 1, as typed models. The JSON Schema is generated from them.

Defaults that hang on other parts of a file (the lease of a list, the type of a register) are worked out by
`expand`; here such a key is None, and `model_fields_set` tells whether it was written.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from gatewayd.core.definition import Fallback
from gatewayd.mapping.can_model import Canopen, Place
from gatewayd.mapping.can_scalars import MillisecondTime
from gatewayd.mapping.plan import Area
from gatewayd.mapping.rules import syntax
from gatewayd.mapping.scalars import (
    Address,
    CellName,
    Duration,
    Endpoint,
    Host,
    Listen,
    Name,
    Names,
    Networks,
    OptionalDuration,
    OutputPolicy,
    Real,
    ReleasePolicy,
    RobotReference,
    Version,
    Whole,
    refuse,
)
from gatewayd.mapping.section import Section
from gatewayd.rtde.types import DEFAULT_PORT

__all__ = [
    "ADOPT_FOR",
    "ANY",
    "FORMAT_VERSION",
    "Group",
    "MappingFile",
    "Modbus",
    "NumberType",
    "PlacementSpec",
    "Robot",
    "Section",
    "VariableSpec",
    "Watchdog",
    "WordOrder",
    "WriterSpec",
]

FORMAT_VERSION = 1
"""Version of the mapping language that this module describes."""
ADOPT_FOR = 10.0
"""Seconds that an adopted input waits for an owner where the file says nothing."""
ANY = "any"
"""The owner that stands for every writer; no writer can have this name."""

NumberType = Literal[
    "bool", "bit", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64"
]
WordOrder = Literal["ABCD", "CDAB", "BADC", "DCBA"]


class Watchdog(Section):
    """Feeding of the robot-side watchdog."""

    field: Name = Field(
        description="RTDE input register that is fed; named in rtde_set_watchdog of the robot program"
    )
    frequency: Real = Field(default=10.0, gt=0, le=500, description="feeds per second")
    requires: Names | None = Field(
        default=None, description="writers that must be alive for the feeding to go on; default: none"
    )


class Robot(Section):
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


class Modbus(Section):
    """One unit of a Modbus TCP listener."""

    listen: Listen = Field(
        default=Endpoint("127.0.0.1", 502),
        description="address and port to listen on",
        json_schema_extra={"default": "127.0.0.1:502"},
    )
    unit: Whole = Field(default=1, ge=1, le=247, description="unit identifier of this cell")
    allow: Networks = Field(
        default=(),
        description="addresses and networks that may connect; default: everybody who reaches the port",
    )
    connections: Whole = Field(default=32, ge=1, le=1024, description="greatest number of connections")
    idle_timeout: OptionalDuration = Field(
        default=60.0, description="a connection without a request for so long is closed; none: never"
    )
    gaps: Literal["refuse", "zero"] = Field(
        default="refuse", description="reading registers that nothing is mapped to: exception 02, or zeros"
    )
    order: WordOrder = Field(
        default="ABCD", description="byte order of all variables that do not name their own"
    )


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


class PlacementSpec(Section):
    """Where a variable lies in Modbus and how its number is written there."""

    model_config = ConfigDict(
        json_schema_extra={
            "oneOf": [{"required": [area]} for area in ("holding", "input", "coil", "discrete")]
        }
    )

    holding: Address | None = Field(default=None, description="holding register (4xxxxx)")
    input: Address | None = Field(default=None, description="input register (3xxxxx), read only")
    coil: Address | None = Field(default=None, description="coil (0xxxxx), one bit")
    discrete: Address | None = Field(default=None, description="discrete input (1xxxxx), one bit, read only")
    type: NumberType | None = Field(default=None, description="number type; default: from the robot's type")
    order: WordOrder | None = Field(
        default=None,
        description="ABCD: big-endian; CDAB: words swapped; BADC: bytes swapped; DCBA: both",
    )
    scale: Real | None = Field(default=None, description="robot value = raw value * scale + offset")
    offset: Real | None = Field(default=None, description="robot value = raw value * scale + offset")

    @model_validator(mode="after")
    def _one_area(self) -> Self:
        given = [area for area in _AREAS if getattr(self, area) is not None]
        if len(given) != 1:
            found = "none" if not given else " and ".join(given)
            message = f"a placement names exactly one of holding, input, coil and discrete; found {found}"
            refuse(
                syntax.BAD_ADDRESS,
                message,
                "write for example {holding: 100}; several placements make a list",
            )
        if self.area.of_bits and self.bit is not None:
            message = f"a {given[0]} address has no bits"
            refuse(syntax.BAD_ADDRESS, message, f"write {{{given[0]}: N}} with a whole number")
        return self

    @property
    def area(self) -> Area:
        """The Modbus table."""
        return next(area for key, area in _AREAS.items() if getattr(self, key) is not None)

    @property
    def area_key(self) -> str:
        """The key that names the table."""
        return next(key for key in _AREAS if getattr(self, key) is not None)

    @property
    def address(self) -> int:
        """Protocol address from 0."""
        return self._place()[0]

    @property
    def bit(self) -> int | None:
        """Bit of the register, or None."""
        return self._place()[1]

    def _place(self) -> tuple[int, int | None]:
        place: tuple[int, int | None] = getattr(self, self.area_key)
        return place


_AREAS = {"holding": Area.HOLDING, "input": Area.INPUT, "coil": Area.COIL, "discrete": Area.DISCRETE}


def _placements(value: Any) -> Any:
    """Bring the short forms into one: `100`, `0.3`, `{coil: 5}`, or a list of them."""
    items = value if isinstance(value, (list, tuple)) else [value]
    return [
        item if isinstance(item, (dict, PlacementSpec)) else {"holding": _present(item)} for item in items
    ]


def _present(item: Any) -> Any:
    if item is None or isinstance(item, (bool, list)):
        refuse(
            syntax.WRONG_TYPE,
            "a Modbus address is missing",
            "write a register (100), a bit (100.3) or {coil: 5}",
        )
    return item


class VariableSpec(Section):
    """One variable, or a family of variables on one line."""

    robot: RobotReference = Field(
        description="RTDE field, 'field[element]', field.bit, or a range of registers such as output_int_register_0..23"
    )
    modbus: Annotated[
        tuple[PlacementSpec, ...],
        BeforeValidator(
            _placements,
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
