"""The compiled Modbus side of a mapping: one unit on one listener, immutable."""

from __future__ import annotations

from dataclasses import dataclass
from ipaddress import IPv4Network, IPv6Network

from gatewayd.mapping.plan import LinkPlan, Plan
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import Codec

__all__ = ["ModbusPlan", "Network", "Placement", "modbus_of"]

Network = IPv4Network | IPv6Network


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
class ModbusPlan(LinkPlan):
    """One unit on one listener."""

    kind = "modbus"

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


def modbus_of(plan: Plan) -> ModbusPlan | None:
    """The Modbus unit of a cell; None: it has none."""
    return plan.of(ModbusPlan).get("modbus")
