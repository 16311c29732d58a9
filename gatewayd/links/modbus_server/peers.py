"""Who is on the other side of a connection: what it may reach, which writer it is, and what happened to it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from ipaddress import IPv4Address, IPv6Address, ip_address

from gatewayd.links.modbus_server.credentials import PeerCredentials
from gatewayd.links.modbus_server.plan import ModbusPlan, Network, RoleWriter

Address = IPv4Address | IPv6Address
Place = Network | RoleWriter
"""By what a writer is known: an address, or the role of a certificate."""
OTHER_PEERS = "other addresses"


class PeerEventKind(Enum):
    """What happened to a connection."""

    CONNECTED = "connected"
    DISCONNECTED = "disconnected"
    DENIED = "not on the access list"
    FULL = "no free connection"
    CROWDED = "too many connections of one peer"
    UNVERIFIED = "certificate not accepted"
    UNSECURED = "TLS handshake failed"
    UNFINISHED = "TLS handshake not finished in time"

    @property
    def refused(self) -> bool:
        """Whether the connection never began."""
        return self in _REFUSED


_REFUSED = frozenset(PeerEventKind) - {PeerEventKind.CONNECTED, PeerEventKind.DISCONNECTED}
WITH_TLS = frozenset({PeerEventKind.UNVERIFIED, PeerEventKind.UNSECURED, PeerEventKind.UNFINISHED})
"""What happens on a listener with TLS alone."""


@dataclass(frozen=True, slots=True)
class PeerEvent:
    """For the log."""

    kind: PeerEventKind
    peer: str
    """Address and port; the address alone where it stands for several events."""
    writers: tuple[str, ...] = ()
    """Names of the writers it is, in the order of the units; empty for a peer that can only read."""
    reason: str = ""
    """Why the connection ended, or could not begin."""
    repeats: int = 0
    """It stands for so many events of the address that were not reported by themselves; 0: for one."""
    credentials: PeerCredentials | None = None
    """What it has shown of itself; None: it connected without TLS, or was refused before."""


def address_of(host: str) -> Address:
    """The address of a socket's peer; an IPv4 peer of an IPv6 socket is an IPv4 peer."""
    address = ip_address(host.partition("%")[0])
    return (isinstance(address, IPv6Address) and address.ipv4_mapped) or address


def may_connect(address: Address, plan: ModbusPlan) -> bool:
    """Whether the unit's access list has the peer."""
    return not plan.allow or any(_within(address, network) for network in plan.allow)


def known_as(
    address: Address, credentials: PeerCredentials | None, plan: ModbusPlan
) -> tuple[Place, int] | None:
    """The writer the peer is, and by what; None: it is none.

    A writer with a role is none without a certificate that has it. Who has shown a certificate may be one by the
    address alone, if it is none by its role; and nobody is one whose role may write nothing.
    """
    if credentials is not None and plan.tls is not None:
        if not plan.tls.rights_of(credentials.role).writes:
            return None
        for its in plan.tls.writers:
            if its.role == credentials.role and (its.network is None or _within(address, its.network)):
                return its, its.writer
    return next(((network, writer) for network, writer in plan.writers if _within(address, network)), None)


def _within(address: Address, network: Network) -> bool:
    return address.version == network.version and address in network


_USUAL = 10
"""So many connections and ends of connections in a minute are no more than a restart of the peer."""


class PeerLog:
    """Which events of connections are reported: a peer may knock, or come and go, a hundred times a second.

    Of each address and kind some in a minute, the number of the others when the minute is over. Beyond a number of
    addresses the others are taken together.
    """

    def __init__(self, interval: float = 60.0, max_peers: int = 256) -> None:
        self._interval = interval
        self._max_peers = max_peers
        self._known: dict[tuple[str, PeerEventKind], _Minute] = {}
        """The one that began first comes first."""

    def reports(self, peer: str, kind: PeerEventKind, now: float) -> bool:
        """Whether this event is reported by itself."""
        minute = self._known.get((peer, kind))
        if minute is None:
            if len(self._known) >= self._max_peers:
                peer = OTHER_PEERS
            minute = self._known.setdefault((peer, kind), _Minute(now, 1 if kind.refused else _USUAL))
        if minute.left:
            minute.left -= 1
            return True
        minute.kept_back += 1
        return False

    def kept_back(self, now: float) -> Iterator[PeerEvent]:
        """Of each minute that is over by `now` what was not reported by itself; called several times in one."""
        while self._known:
            (peer, kind), minute = next(iter(self._known.items()))
            if now - minute.since < self._interval:
                return
            del self._known[peer, kind]
            if minute.kept_back:
                yield PeerEvent(kind, peer, repeats=minute.kept_back)


@dataclass(slots=True)
class _Minute:
    since: float
    left: int
    """How many more are reported by themselves."""
    kept_back: int = 0
