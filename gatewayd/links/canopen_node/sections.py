"""The CANopen part of the mapping language as typed models: the node, its PDOs, and a variable's place in them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from gatewayd.canopen.product import PRODUCT_CODE, VENDOR_ID
from gatewayd.links.canopen_node.scalars import (
    EVENT,
    CobId,
    CobIdRanges,
    InhibitTime,
    Members,
    MillisecondTime,
    RevisionNumber,
    SerialNumber,
    StatusMembers,
    Transmission,
    Word32,
)
from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import Duration, Name, Names, Real, Whole, refuse
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import AfterValidator, BeforeValidator, Field

AUTO = "auto"
"""Stands for the automatic layout; no PDO can have this name."""
NO_PDO = "none"
"""Stands for the object dictionary alone; no PDO can have this name."""

RealType = Literal["REAL64", "REAL32"]
NumberType = Literal[
    "BOOLEAN",
    "INTEGER8",
    "INTEGER16",
    "INTEGER32",
    "INTEGER64",
    "UNSIGNED8",
    "UNSIGNED16",
    "UNSIGNED32",
    "UNSIGNED64",
    "REAL32",
    "REAL64",
]


def _counter(value: int) -> int:
    if value == 1:
        refuse(syntax.OUT_OF_RANGE, "a SYNC counter that overflows at 1 is reserved", "write 0, or 2 to 240")
    return value


class IdentitySpec(Section):
    """What masters know the node by (1018h), and LSS finds it by."""

    vendor: Word32 = Field(
        default=VENDOR_ID,
        description="vendor-ID: one that CiA has assigned to *you*, never another vendor's; 0: none",
    )
    product: Word32 = Field(
        default=PRODUCT_CODE,
        description="product code; devices that an engineering tool must tell apart need different ones",
        json_schema_extra={"default": f"0x{PRODUCT_CODE:X}"},
    )
    revision: RevisionNumber | None = Field(
        default=None,
        description="revision number; auto: it follows the object dictionary; default: the release of gatewayd",
    )
    serial: SerialNumber | None = Field(
        default=None,
        description="serial number; fingerprint: that of the mapping; default: made of the name of the cell",
    )


class Sync(Section):
    """What the node has to do with SYNC."""

    cob_id: CobId = Field(default=0x80, description="COB-ID of SYNC", json_schema_extra={"default": "0x80"})
    producer: bool = Field(default=False, description="whether this node sends SYNC")
    period: Duration | None = Field(
        default=None, description="time between two SYNCs; a consumer states it for the bus load"
    )
    window: Duration | None = Field(
        default=None, description="time after SYNC in which synchronous PDOs count (1007h); default: always"
    )
    counter: Annotated[Whole, AfterValidator(_counter)] = Field(
        default=0,
        ge=0,
        le=240,
        description="greatest value of the counter in SYNC, 2 to 240; 0: SYNC carries none",
    )


class Guarding(Section):
    """Supervision of a master that asks by remote frame, while no heartbeat is produced."""

    time: MillisecondTime = Field(
        default=None,
        description="time between two requests of the master (100Ch); none: it is not supervised",
    )
    factor: Whole = Field(
        default=3,
        ge=1,
        le=255,
        description="how many of these times may pass without one until it is missing (100Dh)",
    )


class Emcy(Section):
    """How EMCY is sent."""

    inhibit: InhibitTime = Field(default=None, description="shortest time between two messages (1015h)")


ERROR_BEHAVIOURS = ("pre_operational", "stay", "stop")
"""What a communication error does, by the value of 1029h."""

_TRANSMISSION = "event (when a value changed), sync (every SYNC), or a type: 0, 1 to 240, 254, 255"
Inhibit = Annotated[InhibitTime, Field(description="least time between two transmissions")]
EventTime = Annotated[
    MillisecondTime, Field(description="greatest time between two transmissions of a PDO from the robot")
]
Deadline = Annotated[
    MillisecondTime,
    Field(description="time without a PDO towards the robot after which it counts as missing"),
]


class PdoDefaults(Section):
    """What holds for every PDO that does not say otherwise."""

    transmission: Transmission = Field(
        default=EVENT, description=_TRANSMISSION, json_schema_extra={"default": "event"}
    )
    inhibit: Inhibit = None
    event: EventTime = None
    deadline: Deadline = None
    real: RealType = Field(default="REAL64", description="type of reals that do not name their own")


class CobIdPool(Section):
    """COB-IDs that this node may use for PDOs beyond the four predefined of each direction."""

    tpdo: CobIdRanges = Field(
        default=(), description="for PDOs from the robot: 0x1A0, 0x1A0..0x1AF, or a list"
    )
    rpdo: CobIdRanges = Field(default=(), description="for PDOs towards the robot: 0x220, or a list")


class PdoSpec(Section):
    """One PDO laid out by hand."""

    cob_id: CobId | None = Field(
        default=None, description="COB-ID; default: the next predefined one, then one of `cob_ids`"
    )
    transmission: Transmission | None = Field(default=None, description=_TRANSMISSION)
    inhibit: Inhibit = None
    event: EventTime = None
    deadline: Deadline = None
    sync_start: Whole = Field(
        default=0, ge=0, le=240, description="counter value of the first SYNC that counts; 0: any"
    )
    status: StatusMembers = Field(
        default=(),
        description="words of the status block, before the variables, in a PDO from the robot: names of its fields "
        "(flags, robot_state), 'quality of force'",
    )
    variables: Members = Field(
        default=(),
        description="variables in their order: start, 'recipe[0..7]'; `canopen: {pdo: NAME}` adds more",
    )
    comment: str = Field(default="", max_length=500, description="for people")


class Canopen(Section):
    """One node on one CAN bus."""

    interface: Annotated[str, Field(min_length=1, max_length=64)] = Field(
        default="socketcan", description="interface of python-can; socketcan is the kernel's"
    )
    channel: Annotated[str, Field(min_length=1, max_length=200)] = Field(
        description="the bus: can0, or what the interface calls it"
    )
    bitrate: Whole = Field(
        gt=0,
        le=1_000_000,
        description="bit/s of the bus; the daemon does not set it, `check` computes with it",
    )
    node: Whole = Field(ge=1, le=127, description="node-ID")
    autostart: bool = Field(default=False, description="become OPERATIONAL without waiting for an NMT master")
    heartbeat: MillisecondTime = Field(
        default=0.5, description="time between two heartbeats; none: no heartbeat"
    )
    guarding: Guarding = Field(
        default_factory=Guarding,
        description="life guarding; only with `heartbeat: none`",
        json_schema_extra={"default": {}},
    )
    emcy: Emcy = Field(default_factory=Emcy, description="EMCY", json_schema_extra={"default": {}})
    on_communication_error: Literal["pre_operational", "stay", "stop"] = Field(
        default="pre_operational",
        description="NMT state after the loss of the bus, of a watched heartbeat or of the guarding (1029h)",
    )
    identity: IdentitySpec = Field(
        default_factory=IdentitySpec, description="identity of the node", json_schema_extra={"default": {}}
    )
    sync: Sync = Field(default_factory=Sync, description="SYNC", json_schema_extra={"default": {}})
    pdo: PdoDefaults = Field(
        default_factory=PdoDefaults, description="defaults of all PDOs", json_schema_extra={"default": {}}
    )
    cob_ids: CobIdPool = Field(
        default_factory=CobIdPool,
        description="COB-IDs for PDOs beyond the predefined ones",
        json_schema_extra={"default": {}},
    )
    pdos: dict[Name, PdoSpec] = Field(default_factory=dict, description="PDOs laid out by hand, by name")


class CanopenPlace(Section):
    """Where a variable is in CANopen."""

    pdo: Name = Field(
        default=AUTO, description="auto (default), none (object dictionary only), or the name of a PDO"
    )
    type: NumberType | None = Field(default=None, description="CiA 301 type; default: from the robot's type")
    scale: Real | None = Field(default=None, description="robot value = raw value * scale + offset")
    offset: Real | None = Field(default=None, description="robot value = raw value * scale + offset")


def _place(value: Any) -> Any:
    """Bring the short forms into one: `auto`, `object`, or a table."""
    if isinstance(value, (dict, CanopenPlace)):
        return value
    if value == AUTO:
        return {}
    if value == "object":
        return {"pdo": NO_PDO}
    hint = "write auto, object, or a table such as {pdo: NAME, type: REAL32}"
    return refuse(syntax.BAD_CHOICE, "`canopen` of a variable is neither auto nor object nor a table", hint)


class CanopenPlaces(Section):
    """What a variable has by CANopen."""

    canopen: (
        Annotated[
            CanopenPlace,
            BeforeValidator(_place, json_schema_input_type=Literal["auto", "object"] | CanopenPlace),
        ]
        | None
    ) = Field(
        default=None, description="auto, object (no PDO), or {pdo: NAME, type: ...}; default: not on CANopen"
    )


class CanopenWriter(Section):
    """What a writer has by CANopen."""

    canopen: Literal["rpdo", "sdo", "any"] | None = Field(
        default=None, description="services of the CANopen node by which it writes: rpdo, sdo, or any (both)"
    )
    pdos: Names = Field(
        default=(),
        description="PDOs towards the robot, by name, that are this writer's alone; default: those of nobody else",
    )
    node: Whole | None = Field(
        default=None, ge=1, le=127, description="node-ID whose heartbeat tells whether it lives (CANopen)"
    )
    heartbeat: MillisecondTime = Field(
        default=None,
        description="time without a heartbeat of `node`, from the writer's first sign of life on, after which it is "
        "lost and writes nothing by CANopen until it is heard",
    )

    guarding: MillisecondTime = Field(
        default=None,
        description="time without a guarding request (remote frame to this node), from the writer's first sign of life "
        "on, after which it is lost; for masters without a heartbeat, with `canopen: heartbeat: none`",
    )

    @property
    def by_rpdo(self) -> bool:
        """Whether RPDOs are this writer's."""
        return self.canopen in ("rpdo", "any")

    @property
    def by_sdo(self) -> bool:
        """Whether SDO requests are this writer's."""
        return self.canopen in ("sdo", "any")
