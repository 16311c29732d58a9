"""Names to addresses, as the name service of this machine has them."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
from contextlib import suppress
from functools import partial

from gatewayd.loop.threads import in_daemon_thread

PATIENCE = 5.0
"""Seconds for an answer."""


async def resolved(host: str, patience: float = PATIENCE) -> list[str]:
    """The addresses of a host, in the order to be tried; OSError if there is none, or no answer in time."""
    with suppress(OSError):
        return _lookup(host, socket.AI_NUMERICHOST)
    try:
        async with asyncio.timeout(patience):
            return await in_daemon_thread(partial(_lookup, host), f"resolve {host}")
    except TimeoutError:
        raise OSError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT)) from None


def _lookup(host: str, flags: int = 0) -> list[str]:
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM, flags=flags)
    except UnicodeError as error:
        raise socket.gaierror(socket.EAI_NONAME, "not a host name") from error
    return list(dict.fromkeys(str(address[0]) for *_, address in found))
