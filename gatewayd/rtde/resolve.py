"""Host names to addresses without holding up anything, the end of the program included.

asyncio looks names up in its executor, which it waits for when the loop is closed: a name server that does not answer
would delay the shutdown by many seconds. A daemon thread is left alone.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from contextlib import suppress

__all__ = ["SocketAddress", "resolve"]

SocketAddress = tuple[
    socket.AddressFamily,
    socket.SocketKind,
    int,
    tuple[str, int] | tuple[str, int, int, int] | tuple[int, bytes],
]
"""Family, kind, protocol and address, as `socket.socket` and `connect` take them."""

_Found = list[SocketAddress]


async def resolve(host: str, port: int) -> _Found:
    """The TCP addresses of `host`, in the order to be tried; socket.gaierror if there is none.

    A numeric address is answered at once, a name by a thread of its own.
    """
    with suppress(socket.gaierror):
        return _lookup(host, port, socket.AI_NUMERICHOST)
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[_Found] = loop.create_future()

    def tell(found: _Found | OSError) -> None:
        if not answer.done():
            if isinstance(found, OSError):
                answer.set_exception(found)
            else:
                answer.set_result(found)

    def ask() -> None:
        found: _Found | OSError
        try:
            found = _lookup(host, port)
        except OSError as error:
            found = error
        with suppress(RuntimeError):  # the loop was closed meanwhile
            loop.call_soon_threadsafe(tell, found)

    threading.Thread(target=ask, name=f"resolve {host}", daemon=True).start()
    return await answer


def _lookup(host: str, port: int, flags: int = 0) -> _Found:
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=flags)
    except UnicodeError as error:
        raise socket.gaierror(socket.EAI_NONAME, "not a host name") from error
    return [(family, kind, protocol, address) for family, kind, protocol, _, address in found]
