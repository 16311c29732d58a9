"""Who asks a cell for something, and what the link that took the request vouches for."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count

from gatewayd.core.definition import OPERATOR


@dataclass(frozen=True, slots=True)
class Requester:
    """The sender of a request, as its link knows it. Links make one for each connection and keep it."""

    writer: int | None
    """Index of the writer in the cell's definition; None: a peer that no writer is declared for."""
    peer: str = ""
    """Address of the peer, for refusals: who reads it knows what to declare."""
    connection: int = 0
    """Number of the connection, unique in the process (`new_connection`); locks follow it. 0: there is none."""
    trusted: bool = True
    """The link's word that the writer keeps what it promised. If it does not (its heartbeat is missing), its requests
    are refused and are no sign of life. The same writer may be trusted by another link."""
    waited: float = 0.0
    """Seconds for which the request may have waited while the gateway stood still; 0: it was read when it came."""


LOCAL_OPERATOR = Requester(OPERATOR)
"""The control socket."""

_connections = count(1)


def new_connection() -> int:
    """A number that no other connection has or had."""
    return next(_connections)


def host_of(peer: str) -> str:
    """The peer's address without its port (`192.0.2.1:502`, `[fe80::1]:502`), which each connection has another one."""
    return peer.rpartition(":")[0] if peer.count(":") == 1 or "]:" in peer else peer
