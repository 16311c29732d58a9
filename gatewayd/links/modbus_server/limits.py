"""How many connections a listener has, and which of them have to end: idle, stalled, or in the way of a new one.

A connection is open before a request says which unit it means, so of several units' limits the most generous count.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Protocol, TypeVar

from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.writers import Accesses, hold_anything

UNUSED_AFTER = 10.0
"""Seconds without a request after which a connection without locks may have to make room for a new one."""
STALLED_AFTER = 5.0
"""Seconds for which a peer may leave its answers unread."""


class _Limited(Protocol):
    """As much of a connection as limits look at."""

    @property
    def last_request(self) -> float: ...
    @property
    def stalled_since(self) -> float | None: ...
    @property
    def accesses(self) -> Accesses: ...


_Connection = TypeVar("_Connection", bound=_Limited)


def max_connections(plans: Iterable[ModbusPlan]) -> int:
    """The greatest number of connections."""
    return max((plan.connections for plan in plans), default=0)


def max_per_peer(plans: Iterable[ModbusPlan]) -> int:
    """The greatest number of connections of one address."""
    return max((plan.max_per_peer for plan in plans), default=0)


def idle_timeout(plans: Collection[ModbusPlan]) -> float | None:
    """Seconds without a request after which a connection is closed; None: never."""
    timeouts = [plan.idle_timeout for plan in plans if plan.idle_timeout is not None]
    return max(timeouts) if timeouts and len(timeouts) == len(plans) else None


def longest_unused(connections: Iterable[_Connection], now: float) -> _Connection | None:
    """The connection that makes room for a new one, if any is unused and owns nothing (TCP guide, 4.2.2)."""
    unused = [
        connection
        for connection in connections
        if now - connection.last_request >= UNUSED_AFTER and not hold_anything(connection.accesses)
    ]
    return min(unused, key=lambda connection: connection.last_request, default=None)


def overdue(connection: _Limited, idle: float | None, now: float) -> str:
    """Why the connection must end now; empty: it need not."""
    if connection.stalled_since is not None and now - connection.stalled_since > STALLED_AFTER:
        return f"did not read its answers for {STALLED_AFTER:g} s"
    if idle is not None and now - connection.last_request > idle and not hold_anything(connection.accesses):
        return f"no request for {idle:g} s"
    return ""
