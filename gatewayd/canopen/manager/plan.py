"""What a manager has to know of its bus and of its devices, immutable. No data sheet is needed beside it."""

from __future__ import annotations

from dataclasses import dataclass, field

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.sync import SyncPlan

MAX_PDO_BITS = 64
"""What one CAN frame carries."""


@dataclass(frozen=True, slots=True)
class PdoObject:
    """An object in a PDO, or a gap (a dummy entry) where index is below 20h."""

    index: int
    subindex: int
    bits: int
    type: CanType | None = None
    """None: a type that is not known here. Its bits are carried as they are, as an unsigned number."""

    @property
    def entry(self) -> int:
        """The UNSIGNED32 of a mapping object: index, sub-index, bits (CiA 301, 7.5.2.36 and .38)."""
        return self.index << 16 | self.subindex << 8 | self.bits


@dataclass(frozen=True, slots=True)
class ManagedPdo:
    """A PDO of a device; the names are the device's, so it transmits a TPDO and the manager receives it."""

    number: int
    """From 1."""
    transmit: bool
    cob_id: int
    objects: tuple[PdoObject, ...]
    written: bool = False
    """The manager lays it out; otherwise it is taken as it is, after its layout was compared."""
    transmission: int | None = None
    """Transmission type to write (sub-index 2), where it is written; None: as it is."""
    inhibit: int | None = None
    """Inhibit time in 100 us (sub-index 3), where it is written."""
    event: int | None = None
    """Event timer in ms (sub-index 5), where it is written."""
    no_remote: bool = False
    """Bit 30 of the COB-ID of a TPDO: it cannot be asked for by a remote frame."""
    spacing: float = 0.0
    """RPDO: least time in seconds between two that the manager sends."""
    repeat: float = 0.0
    """RPDO: seconds after which it is sent again without a change; 0: never."""

    @property
    def label(self) -> str:
        """`TPDO 1`."""
        return f"{'T' if self.transmit else 'R'}PDO {self.number}"

    @property
    def communication(self) -> int:
        """Index of its communication parameter."""
        return (0x1800 if self.transmit else 0x1400) + self.number - 1

    @property
    def mapping(self) -> int:
        """Index of its mapping parameter."""
        return (0x1A00 if self.transmit else 0x1600) + self.number - 1


@dataclass(frozen=True, slots=True)
class Setting:
    """A value that an object of a device has to have; little-endian bytes."""

    index: int
    subindex: int
    data: bytes

    @property
    def meaning(self) -> list[int | str]:
        """The same in the types of JSON."""
        return [self.index, self.subindex, self.data.hex()]


@dataclass(frozen=True, slots=True)
class ExpectedIdentity:
    """What 1000h and 1018h must say; None: anything."""

    device_type: int | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    serial: int | None = None


@dataclass(frozen=True, slots=True)
class ObjectReading:
    """An object that is read by SDO after each start of the device, and then every `period` seconds; 0: no more."""

    index: int
    subindex: int
    type: CanType
    period: float = 0.0


@dataclass(frozen=True, slots=True)
class NodePlan:
    """One device."""

    node: int
    expected: ExpectedIdentity = ExpectedIdentity()
    mandatory: bool = False
    """No device of the bus is started before this one can be."""
    keep: bool = False
    """Found operational and laid out as planned, it is left as it is; otherwise it is reset first."""
    heartbeat: float = 0.0
    """Seconds that the device may be silent; 0: it has no heartbeat, and is asked for 1000h instead."""
    producer: int = 0
    """Its producer heartbeat time (1017h) in ms, which is written; 0: left as it is."""
    alive: float = 2.0
    """Seconds between two questions for 1000h to a device without heartbeat."""
    software: str | None = None
    """What 100Ah must say; None: anything."""
    settings: tuple[Setting, ...] = ()
    """Its configuration, in the order in which it is written."""
    configured: tuple[int, int] | None = None
    """Days and milliseconds of 1020h: a device that has both keeps its configuration."""
    store: bool = False
    """Have the device save what was written (1010h)."""
    sdo_timeout: float = 1.0
    boot_time: float = 5.0
    """Seconds from a reset to the boot-up message."""
    pdos: tuple[ManagedPdo, ...] = ()
    readings: tuple[ObjectReading, ...] = ()


@dataclass(frozen=True, slots=True)
class ManagerPlan:
    """The manager's own part of a bus."""

    interface: str
    channel: str
    bitrate: int
    node: int | None = None
    """Node-ID of its heartbeat; None: it has none."""
    heartbeat: int = 0
    """Milliseconds between two of its heartbeats; 0: none."""
    sync: SyncPlan = field(default_factory=SyncPlan)
    start_all: bool = False
    """One NMT command starts all devices at once, where all of them are ready."""

    @property
    def address(self) -> str:
        """Of the bus: `socketcan:can1`."""
        return f"{self.interface}:{self.channel}"
