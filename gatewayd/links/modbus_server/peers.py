"""Who is on the other side of a connection: what it may reach, which writer it is, and what happened to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from ipaddress import IPv4Address, IPv6Address, ip_address

from gatewayd.links.modbus_server.plan import ModbusPlan, Network

Address = IPv4Address | IPv6Address


class PeerEventKind(Enum):
    """What happened to a connection."""

    CONNECTED = "connected"
    DISCONNECTED = "disconnected"
    DENIED = "not on the access list"
    FULL = "no free connection"


@dataclass(frozen=True, slots=True)
class PeerEvent:
    """For the log."""

    kind: PeerEventKind
    peer: str
    """Address and port."""
    writers: tuple[str, ...] = ()
    """Names of the writers it is, in the order of the units; empty for a peer that can only read."""
    reason: str = ""
    """Why the connection ended, or could not begin."""
    repeats: int = 0
    """How many equal events were not reported since the last one."""


def address_of(host: str) -> Address:
    """The address of a socket's peer; an IPv4 peer of an IPv6 socket is an IPv4 peer."""
    address = ip_address(host.partition("%")[0])
    return (isinstance(address, IPv6Address) and address.ipv4_mapped) or address


def may_connect(address: Address, plan: ModbusPlan) -> bool:
    """Whether the unit's access list has the peer."""
    return not plan.allow or any(_within(address, network) for network in plan.allow)


def writer_of(address: Address, writers: Sequence[tuple[Network, int]]) -> int | None:
    """The writer the peer is; `writers` has the most specific network first."""
    return next((writer for network, writer in writers if _within(address, network)), None)


def _within(address: Address, network: Network) -> bool:
    return address.version == network.version and address in network


class DenialLog:
    """Lets one denial per address and interval through: a refused client may knock a hundred times a second."""

    def __init__(self, interval: float = 60.0, max_hosts: int = 256) -> None:
        self._interval = interval
        self._max_hosts = max_hosts
        self._reported: dict[str, tuple[float, int]] = {}

    def repeats(self, host: str, now: float) -> int | None:
        """How many denials of `host` were kept back before this one; None: keep this one back as well."""
        reported, kept_back = self._reported.get(host, (-self._interval, 0))
        if now - reported < self._interval:
            self._reported[host] = (reported, kept_back + 1)
            return None
        self._reported.pop(host, None)
        if len(self._reported) >= self._max_hosts:
            del self._reported[next(iter(self._reported))]
        self._reported[host] = (now, 0)
        return kept_back
