"""The compiled Modbus side of a mapping: one unit on one listener, immutable."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from ipaddress import IPv4Network, IPv6Network
from typing import TypeVar

from gatewayd.links.modbus_places.located import Located
from gatewayd.mapping.plan import LinkPlan
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import Codec
from gatewayd.modbus.exceptions import ExceptionCode

Network = IPv4Network | IPv6Network
Endpoint = tuple[str, int]
"""Host and port as the mapping has them."""


def network_text(network: Network) -> str:
    """An address, or a network with its length."""
    return str(network.network_address) if network.num_addresses == 1 else str(network)


@dataclass(frozen=True, slots=True)
class Placement(Located):
    """Where one variable lies in a Modbus area, and how its number is written there."""

    variable: int
    """Index into `CellDefinition.variables`."""
    area: Area
    address: int
    bit: int | None
    codec: Codec | None


@dataclass(frozen=True, slots=True)
class RoleRights:
    """What certificates with one role may do (Modbus/TCP Security, R-26 to R-28). A role without any may nothing."""

    role: str | None
    """None: certificates without a role (R-23)."""
    readable: tuple[int, ...] | None = ()
    """Indices of variables; None: everything."""
    writable: tuple[int, ...] | None = ()

    @property
    def writes(self) -> bool:
        """Whether there is anything that it may write."""
        return self.writable != ()


@dataclass(frozen=True, slots=True)
class RoleWriter:
    """How a writer is known by its certificate."""

    role: str
    network: Network | None
    """From where it has to connect; None: from anywhere."""
    writer: int

    @property
    def text(self) -> str:
        """`role operator`, `role operator at 192.0.2.20`."""
        return f"role {self.role}" + (f" at {network_text(self.network)}" if self.network is not None else "")


@dataclass(frozen=True, slots=True)
class TrustFiles:
    """Paths of the files by which a secured listener and its clients know each other."""

    certificate: str
    """PEM: the listener's own, and those between it and the authority."""
    key: str
    clients: str
    """PEM: the authorities of the clients."""
    revoked: str | None
    """PEM: revocation lists, one of each authority."""


@dataclass(frozen=True, slots=True)
class SecuredPlan:
    """The secured listener of a unit."""

    host: str
    port: int
    files: TrustFiles
    roles: tuple[RoleRights, ...] = ()
    writers: tuple[RoleWriter, ...] = ()
    """Most specific network first."""

    def rights_of(self, role: str | None) -> RoleRights:
        """What the certificates with a role may do; one that no mapping names may nothing."""
        return next((rights for rights in self.roles if rights.role == role), RoleRights(role))


@dataclass(frozen=True, slots=True)
class ModbusPlan(LinkPlan):
    """One unit on one listener."""

    kind = "modbus"

    host: str
    """Where the unit is reached first of all: of a unit with the secured listener alone this is that one."""
    port: int
    unit: int
    allow: tuple[Network, ...]
    """Networks that may connect; empty: every peer."""
    connections: int
    idle_timeout: float | None
    fill_gaps: bool
    """Addresses with nothing mapped read 0 instead of answering exception 02."""
    placements: tuple[Placement, ...]
    writers: tuple[tuple[Network, int], ...]
    """Peer network -> writer, most specific first."""
    ignore_gaps: bool = False
    """What has nothing mapped is let pass in a write that meets anything mapped."""
    connections_per_peer: int | None = None
    """None: half of `connections`, at least 4."""
    default_unit: bool = False
    """Whether it answers to the unit ids 0 and 255, though other cells share the listener."""
    robot_away: ExceptionCode = ExceptionCode.TARGET_FAILED
    """The answer to what cannot be done because the robot is away."""
    tls: SecuredPlan | None = None
    plain: bool = True
    """Whether it has a listener without TLS."""

    @property
    def endpoints(self) -> dict[Endpoint, TrustFiles | None]:
        """Where it is reached, and by which files where that is secured."""
        found: dict[Endpoint, TrustFiles | None] = {(self.host, self.port): None} if self.plain else {}
        if self.tls is not None:
            found[self.tls.host, self.tls.port] = self.tls.files
        return found

    @property
    def max_per_peer(self) -> int:
        """The greatest number of connections of one address."""
        return self.connections_per_peer or max(4, self.connections // 2)


_Key = TypeVar("_Key")


def default_of(units: Iterable[tuple[_Key, ModbusPlan]]) -> _Key | None:
    """Which answers to the unit ids 0 and 255, of those that a client may reach: the only one, or the declared one."""
    reached = list(units)
    candidates = reached if len(reached) == 1 else [unit for unit in reached if unit[1].default_unit]
    return candidates[0][0] if len(candidates) == 1 else None
