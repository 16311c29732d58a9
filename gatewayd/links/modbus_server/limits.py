"""Which connections of a listener have to end: idle or stalled.

A connection is open before a request says which unit it means, so of several units' limits the most generous count.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Protocol

from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.writers import Accesses, hold_anything

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


def idle_timeout(plans: Collection[ModbusPlan]) -> float | None:
    """Seconds without a request after which a connection is closed; None: never."""
    timeouts = [plan.idle_timeout for plan in plans if plan.idle_timeout is not None]
    return max(timeouts) if timeouts and len(timeouts) == len(plans) else None


def overdue(connection: _Limited, idle: float | None, now: float) -> str:
    """Why the connection must end now; empty: it need not."""
    if connection.stalled_since is not None and now - connection.stalled_since > STALLED_AFTER:
        return f"did not read its answers for {STALLED_AFTER:g} s"
    if idle is not None and now - connection.last_request > idle and not hold_anything(connection.accesses):
        return f"no request for {idle:g} s"
    return ""
