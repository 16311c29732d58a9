"""The compiled mapping: everything the links need, worked out once, immutable.

`gatewayd.mapping.compile` makes it; `gatewayd.daemon` hands its parts to the core and to the links. It travels between
processes (pickle), and equals what it was there.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from ipaddress import IPv4Network, IPv6Network

from gatewayd.canopen.plan import CanopenPlan
from gatewayd.core.definition import CellDefinition
from gatewayd.mapping.codec import Codec

__all__ = ["AREA_NAMES", "Area", "ModbusPlan", "Network", "Placement", "Plan", "RobotPlan", "WatchdogPlan"]

Network = IPv4Network | IPv6Network


class Area(Enum):
    """A Modbus data table (Application Protocol V1.1b3, 4.3). The value is the first digit of its 6-digit notation."""

    COIL = 0
    DISCRETE = 1
    INPUT = 3
    HOLDING = 4

    @property
    def of_bits(self) -> bool:
        """Whether an address of the area is one bit instead of one 16-bit register."""
        return self in (Area.COIL, Area.DISCRETE)

    def notation(self, address: int) -> str:
        """The 4xxxxx form of a protocol address: `Area.HOLDING.notation(0)` is `400001`."""
        return f"{self.value}{address + 1:05d}"


AREA_NAMES = {Area.COIL: "coil", Area.DISCRETE: "discrete", Area.INPUT: "input", Area.HOLDING: "holding"}
"""Areas as the mapping file names them."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Where one variable lies in a Modbus area, and how its number is written there."""

    variable: int
    """Index into `CellDefinition.variables`."""
    area: Area
    address: int
    """Protocol address from 0: of the first register, or of the coil."""
    bit: int | None
    """Bit of the register (0 = least significant) for a bit packed into a register; else None."""
    codec: Codec | None
    """Number encoding of whole registers; None for coils, discrete inputs and packed bits."""

    @property
    def words(self) -> int:
        """Addresses covered: registers, or 1 for a coil or a packed bit."""
        return self.codec.words if self.codec is not None else 1


@dataclass(frozen=True, slots=True)
class WatchdogPlan:
    """The input register that is fed while gateway and required writers are healthy (URScript `rtde_set_watchdog`)."""

    field: str
    frequency: float
    """Feeds per second."""
    requires: tuple[int, ...]
    """Writers that must be alive for the feeding to go on."""


@dataclass(frozen=True, slots=True)
class RobotPlan:
    """How to reach the controller and what to ask of it."""

    host: str
    port: int
    frequency: float
    """Output packages per second asked for; 0: the controller's own rate."""
    outputs: tuple[str, ...]
    """Fields to subscribe, in the order of their first variable; without `timestamp` and read-backs."""
    inputs: tuple[str, ...]
    """Fields to claim, in the order of their first variable."""
    verify: bool
    """Compare what was written with what the controller reads back."""
    watchdog: WatchdogPlan | None = None


@dataclass(frozen=True, slots=True)
class ModbusPlan:
    """One unit on one listener."""

    host: str
    port: int
    unit: int
    allow: tuple[Network, ...]
    """Networks that may connect; empty: every peer."""
    connections: int
    idle_timeout: float | None
    fill_gaps: bool
    """Unmapped registers between mapped ones read as 0 instead of answering exception 02."""
    placements: tuple[Placement, ...]
    writers: tuple[tuple[Network, int], ...]
    """Peer network -> writer, most specific first."""


@dataclass(frozen=True, slots=True)
class Plan:
    """One robot cell, compiled."""

    source: str
    """Path of the mapping file as given."""
    cell: CellDefinition
    robot: RobotPlan
    modbus: ModbusPlan | None
    canopen: CanopenPlan | None = None
