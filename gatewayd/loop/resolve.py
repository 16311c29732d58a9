"""Host names to addresses, without holding up anything."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
from collections.abc import Iterable
from contextlib import suppress
from functools import partial

from gatewayd.loop.threads import in_daemon_thread

SocketAddress = tuple[
    socket.AddressFamily,
    socket.SocketKind,
    int,
    tuple[str, int] | tuple[str, int, int, int] | tuple[int, bytes],
]
"""Family, kind, protocol and address, as `socket.socket` and `connect` take them."""


def look_up(host: str | None, port: int, flags: int = 0) -> list[SocketAddress]:
    """The TCP addresses of `host`, which may take long. `flags`: of getaddrinfo(3); AI_PASSIVE allows None."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=flags)
    except UnicodeError as error:
        raise socket.gaierror(socket.EAI_NONAME, "not a host name") from error
    return [(family, kind, protocol, address) for family, kind, protocol, _, address in found]


async def resolve(host: str, port: int, patience: float | None = None) -> list[SocketAddress]:
    """The TCP addresses of `host`, in the order to be tried; socket.gaierror if there is none.

    A numeric address is answered at once, a name by a thread of its own; TimeoutError after `patience` seconds.
    """
    with suppress(socket.gaierror):
        return look_up(host, port, socket.AI_NUMERICHOST)
    try:
        async with asyncio.timeout(patience):
            return await in_daemon_thread(partial(look_up, host, port), f"resolve {host}")
    except TimeoutError:
        raise TimeoutError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT)) from None


def hosts(found: Iterable[SocketAddress]) -> list[str]:
    """The numeric addresses as texts, each once."""
    return list(dict.fromkeys(str(address[0]) for *_, address in found))
