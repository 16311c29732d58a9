"""The Modbus part of the mapping language: the section `modbus`, and a variable's places in registers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from gatewayd.links.modbus_places.sections import AREA_KEYS, RegisterSpec, WordOrder
from gatewayd.links.modbus_server.tls_sections import RoleName, Tls
from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import Listen, ListenAddress, Networks, OptionalDuration, Whole, refuse
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import BeforeValidator, Field

RobotAway = Literal["target_failed", "path_unavailable", "device_failure", "busy"]


class Modbus(Section):
    """One unit of a Modbus TCP listener."""

    listen: Listen = Field(
        default=ListenAddress("127.0.0.1", 502),
        description="address and port to listen on; with `tls` and without this key: none without TLS",
        json_schema_extra={"default": "127.0.0.1:502"},
    )
    unit: Whole = Field(default=1, ge=1, le=247, description="unit identifier of this cell")
    allow: Networks = Field(
        default=(),
        description="addresses and networks that may connect; default: everybody who reaches the port",
    )
    default_unit: bool = Field(
        default=False,
        description="answer to unit ids 0 and 255 too, where several cells share the listener; a sole cell always does",
    )
    connections: Whole = Field(default=32, ge=1, le=1024, description="greatest number of connections")
    connections_per_peer: Whole | None = Field(
        default=None,
        ge=1,
        le=1024,
        description="greatest number of connections of one address; default: half of `connections`, at least 4",
    )
    idle_timeout: OptionalDuration = Field(
        default=60.0, description="a connection without a request for this long is closed; none: never"
    )
    gaps: Literal["refuse", "zero"] = Field(
        default="refuse",
        description="reading addresses below 60000 that nothing is mapped to: exception 02, or zeros",
    )
    write_gaps: Literal["refuse", "ignore"] = Field(
        default="refuse",
        description="registers and bits that nothing is mapped to, in a write that meets something mapped: "
        "exception 02 to the whole write, or let them pass without effect",
    )
    robot_away: RobotAway = Field(
        default="target_failed",
        description="answer to reads and writes that fail because the robot is away: exception 0B, 0A, 04 or 06",
    )
    order: WordOrder = Field(
        default="ABCD",
        description="order of values of two or more registers that do not name their own; values of one register "
        "(16 bits, `bool`, bits) stay as they are",
    )
    tls: Tls | None = Field(default=None, description="a listener with TLS, beside the other or in its place")

    @property
    def addresses(self) -> Mapping[tuple[str, ...], ListenAddress]:
        """Path of the key -> where it is listened, the one without TLS first."""
        plain = self.tls is None or "listen" in self.model_fields_set
        found: dict[tuple[str, ...], ListenAddress] = {("listen",): self.listen} if plain else {}
        return found if self.tls is None else {**found, ("tls", "listen"): self.tls.listen}


class PlacementSpec(RegisterSpec):
    """Where a variable lies in Modbus and how its number is written there."""

    schema_extra: ClassVar[Mapping[str, Any]] = {"oneOf": [{"required": [area]} for area in AREA_KEYS]}


def _places(value: Any) -> Any:
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
            "write a register (100), a bit (100.3), a byte (100.high) or {coil: 5}",
        )
    return item


class ModbusPlaces(Section):
    """What a variable has by Modbus."""

    modbus: Annotated[
        tuple[PlacementSpec, ...],
        BeforeValidator(
            _places, json_schema_input_type=float | str | PlacementSpec | list[float | str | PlacementSpec]
        ),
    ] = Field(
        default=(),
        description="address from 0 (100, 0x64), bit (100.3) or byte (100.high) of a register, "
        "{area: address, type: ...}, or a list of these",
    )


class ModbusWriter(Section):
    """What a writer has by Modbus."""

    modbus: Networks = Field(
        default=(), description="address or network of the Modbus client, or a list of them"
    )
    role: RoleName | None = Field(
        default=None,
        description="role of its certificate: it is known by that, on the listener with TLS alone; with `modbus` it "
        "has to connect from there as well",
    )
