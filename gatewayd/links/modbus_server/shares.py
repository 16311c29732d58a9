"""Fair shares: who gets a connection where there are not enough for everybody.

Each address under `writers:` has a place of its own, kept free while nobody from there is connected, so that no reader
ever keeps a declared writer out. What is left is for the first that come, up to a limit for each peer (an address).
When all is taken a newcomer may take the place of another one. Readers, longest unused first, make room for a writer
at any time; among themselves, readers and writers alike, only who was unused for a while, or has two connections more
than the newcomer's peer, so that nobody can take a place back from whom he gave it to. A writer never makes room for a
reader, a connection that holds a lock for nobody.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from typing import Protocol, TypeVar

from gatewayd.links.modbus_server.credentials import PeerCredentials
from gatewayd.links.modbus_server.peers import Address, PeerEventKind, Place, known_as, may_connect
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.writers import Accesses, hold_anything

UNUSED_AFTER = 10.0
"""Seconds without a request after which a connection counts as unused."""


class _Connection(Protocol):
    """As much of a connection as shares look at."""

    @property
    def address(self) -> Address | None: ...
    @property
    def places(self) -> frozenset[Place]: ...
    @property
    def last_request(self) -> float: ...
    @property
    def accesses(self) -> Accesses: ...


_Present = TypeVar("_Present", bound=_Connection)


class Shares:
    """The connections of one listener. Of several units' limits the most generous count."""

    def __init__(self, plans: Collection[ModbusPlan], *, secured: bool = False) -> None:
        """`secured`: of a listener with TLS, where places are kept for the writers that are known by a role."""
        self._plans = tuple(plans)
        self._connections = max((plan.connections for plan in plans), default=0)
        self._per_peer = max((plan.max_per_peer for plan in plans), default=0)
        self._places: frozenset[Place] = frozenset(
            place for plan in plans for place in (_of_roles(plan) if secured else _of_addresses(plan))
        )

    def places_of(self, address: Address, credentials: PeerCredentials | None = None) -> frozenset[Place]:
        """The places that a peer fills: of each unit's writers the one that it is. Empty: no writer is declared."""
        found = (known_as(address, credentials, plan) for plan in self._plans if may_connect(address, plan))
        return frozenset(known[0] for known in found if known is not None)

    def room_for(
        self, newcomer: _Connection, present: Collection[_Present], now: float
    ) -> list[_Present] | PeerEventKind:
        """The connections that have to end for the newcomer, longest unused first; or why it is refused."""
        own = [connection for connection in present if connection.address == newcomer.address]
        if len(own) >= self._per_peer:
            unused = _unused_first(newcomer, _free_to_end(own), now)
            return unused[:1] or PeerEventKind.CROWDED
        if self._fits(newcomer, present):
            return []
        others = _free_to_end(present)
        if not newcomer.places:
            others = [connection for connection in others if not connection.places]
        return (
            self._enough(newcomer, present, _unused_first(newcomer, others, now))
            or self._enough(newcomer, present, _of_the_greediest(newcomer, others, present)[:1])
            or PeerEventKind.FULL
        )

    def _enough(
        self, newcomer: _Connection, present: Collection[_Present], candidates: Iterable[_Present]
    ) -> list[_Present]:
        """The first of the candidates whose end makes room enough; none if that of all of them does not."""
        kept, ended = set(present), []
        for candidate in candidates:
            fewer = kept - {candidate}
            if self._taken(newcomer, fewer) == self._taken(newcomer, kept):
                continue  # it is the only one of its writer, whose place would have to be kept in its stead
            kept = fewer
            ended.append(candidate)
            if self._fits(newcomer, kept):
                return ended
        return []

    def _fits(self, newcomer: _Connection, present: Collection[_Present]) -> bool:
        return self._taken(newcomer, present) < self._connections

    def _taken(self, newcomer: _Connection, present: Collection[_Present]) -> int:
        """Connections, and places kept for writers that are not there; these do not count for one who fills one."""
        vacant = self._places.difference(*(connection.places for connection in present))
        if vacant & newcomer.places:
            return len(present)
        return len(present) + min(len(vacant), self._connections - 1)


def _of_addresses(plan: ModbusPlan) -> Iterable[Place]:
    return (network for network, _writer in plan.writers)


def _of_roles(plan: ModbusPlan) -> Iterable[Place]:
    return plan.tls.writers if plan.tls is not None else ()


def _free_to_end(connections: Iterable[_Present]) -> list[_Present]:
    return [connection for connection in connections if not hold_anything(connection.accesses)]


def _unused_first(newcomer: _Connection, others: Iterable[_Present], now: float) -> list[_Present]:
    """Those that are unused, and all readers for a writer; readers first, then by the time of their last request."""
    ordered = [
        connection
        for connection in others
        if now - connection.last_request >= UNUSED_AFTER or (newcomer.places and not connection.places)
    ]
    return sorted(ordered, key=lambda connection: (bool(connection.places), connection.last_request))


def _of_the_greediest(
    newcomer: _Connection, others: Iterable[_Present], present: Iterable[_Present]
) -> list[_Present]:
    """Those of peers with at least two connections more than the newcomer's, of the peer with most of them first."""
    count = Counter(connection.address for connection in present)
    fair = count[newcomer.address] + 2
    ordered = [connection for connection in others if count[connection.address] >= fair]
    return sorted(ordered, key=lambda connection: (-count[connection.address], connection.last_request))
