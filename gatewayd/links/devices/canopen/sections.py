"""What CANopen devices and places in them have in the mapping language."""

from __future__ import annotations

from typing import Annotated, Literal

from gatewayd.links.devices.canopen.scalars import IdentityNumber, ObjectIndex, PdoNumber
from gatewayd.mapping.scalars import Duration, OptionalDuration, Whole
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import Field

DEFAULT_BITRATE = 500_000


class CanopenDeviceKeys(Section):
    """How a CANopen device is reached, known and watched."""

    canopen: Annotated[str, Field(min_length=1, max_length=200)] | None = Field(
        default=None, description="the CAN bus of a CANopen device, which this gateway manages: can1"
    )
    interface: Annotated[str, Field(min_length=1, max_length=64)] = Field(
        default="socketcan", description="interface of python-can; socketcan is the kernel's"
    )
    bitrate: Whole = Field(
        default=DEFAULT_BITRATE,
        gt=0,
        le=1_000_000,
        description="bit/s of the bus; the daemon does not set it, `check` computes with it",
    )
    node: Whole | None = Field(default=None, ge=1, le=127, description="node-ID of a CANopen device")
    eds: Annotated[str, Field(min_length=1, max_length=500)] | None = Field(
        default=None,
        description="data sheet of the device (EDS, or DCF with values that are written into it), beside this file; "
        "`check` reads it, the daemon does not",
    )
    heartbeat: OptionalDuration = Field(
        default=None,
        description="time without a heartbeat after which the device is lost; the gateway has it send one every third "
        "of that. none: it has no heartbeat, and is asked now and then",
    )
    mandatory: bool = Field(
        default=False, description="whether no device on the bus is started before this one can be"
    )
    keep: bool = Field(
        default=False,
        description="leave the device as it is where it is found in operation with the planned PDOs; otherwise it is "
        "reset first",
    )
    store: bool = Field(default=False, description="have the device save what was written into it (1010h)")
    revision: IdentityNumber | None = Field(
        default=None, description="revision number that the device must have; default: any"
    )
    expected_serial: IdentityNumber | None = Field(
        default=None, description="serial number that the device must have; default: any"
    )
    software: Annotated[str, Field(min_length=1, max_length=64)] | None = Field(
        default=None, description="software version that the device must have (100Ah); default: any"
    )
    transmission: Literal["event", "sync"] = Field(
        default="event",
        description="of PDOs that the gateway lays out: when a value changed, or with every SYNC",
    )
    inhibit: Duration | None = Field(
        default=None,
        description="least time between two transmissions of a PDO, where it is not that of the device",
    )
    event: Duration | None = Field(
        default=None, description="greatest time between two transmissions of a PDO that the gateway lays out"
    )
    sync: Duration | None = Field(
        default=None,
        description="time between two SYNCs that the gateway sends; the same for all devices of a bus",
    )
    manager: Whole | None = Field(
        default=None,
        ge=1,
        le=127,
        description="node-ID of the gateway's own heartbeat on the bus; the same for all devices of a bus",
    )
    manager_heartbeat: Duration | None = Field(
        default=None,
        description="time between two heartbeats of the gateway; the same for all devices of a bus",
    )


class CanopenPlaceKeys(Section):
    """A place in a CANopen device."""

    object: ObjectIndex | None = Field(
        default=None, description="index of an object in the dictionary of a CANopen device: 0x6004"
    )
    sub: Whole = Field(
        default=0, ge=0, le=255, description="sub-index of the object; of a family that of its first member"
    )
    pdo: PdoNumber | None = Field(
        default=None,
        description="PDO of the device that the gateway lays out with this object, from 1; none: it goes by SDO. "
        "Default: the PDO that has it by the data sheet, else SDO",
    )
