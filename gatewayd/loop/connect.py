"""TCP connections to a host by name or address, and when the kernel takes the peer for dead."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from gatewayd.loop.resolve import resolve

_Protocol = TypeVar("_Protocol", bound=asyncio.BaseProtocol)


@dataclass(frozen=True, slots=True)
class DeadPeer:
    """When the kernel ends a connection by itself (tcp(7)): also while nothing is due from the peer."""

    idle: int
    """Seconds of silence before the first probe."""
    interval: int
    """Seconds between two probes."""
    probes: int
    """Unanswered probes that end the connection."""
    unacknowledged: int
    """Milliseconds after which what the peer does not acknowledge ends the connection (RFC 5482).

    Otherwise the pauses between repetitions grow to minutes. Set before a connection, it bounds the attempt too."""

    def watch(self, connection: socket.socket) -> None:
        """Set the options of `connection`; what a system does not have is left out."""
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in (
            ("TCP_KEEPIDLE", self.idle),
            ("TCP_KEEPINTVL", self.interval),
            ("TCP_KEEPCNT", self.probes),
            ("TCP_USER_TIMEOUT", self.unacknowledged),
        ):
            option = getattr(socket, name, None)
            if option is not None:
                with contextlib.suppress(OSError):
                    connection.setsockopt(socket.IPPROTO_TCP, option, value)


async def connect(
    make: Callable[[], _Protocol], host: str, port: int, dead_peer: DeadPeer | None = None
) -> _Protocol:
    """Connect the protocol of `make` to the first address of `host` that answers.

    Raises socket.gaierror for a host without an address, otherwise the error of the last address. `dead_peer` holds
    from the attempt on.
    """
    loop = asyncio.get_running_loop()
    failure: OSError = socket.gaierror(socket.EAI_NONAME, "no address")
    for family, kind, protocol, address in await resolve(host, port):
        try:
            candidate = socket.socket(family, kind, protocol)
        except OSError as error:  # a family that this machine does not have
            failure = error
            continue
        try:
            candidate.setblocking(False)
            candidate.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if dead_peer is not None:
                dead_peer.watch(candidate)
            await loop.sock_connect(candidate, address)
            _, connected = await loop.create_connection(make, sock=candidate)
        except OSError as error:
            candidate.close()
            failure = error
        except BaseException:
            candidate.close()
            raise
        else:
            return connected
    raise failure
