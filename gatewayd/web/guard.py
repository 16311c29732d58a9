"""What stands between the status listener and all that reach its port: bounds, headers, host check, token.

Reading is free; everything else needs the token. No answer ever carries a traceback.
"""

from __future__ import annotations

import asyncio
import hmac
import logging
from collections import defaultdict
from collections.abc import Awaitable, Callable
from ipaddress import ip_address
from typing import cast

from aiohttp import web
from aiohttp.typedefs import Middleware
from aiohttp.web_protocol import RequestHandler

from gatewayd.control.server import asker
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.share import Busy, LoopShare

MAX_CONNECTIONS = 32
"""Open at a time; further ones are closed at once, so that a flood costs the robot's loop next to nothing."""
FAIR = 8
"""Connections of one peer that nobody takes from it. It may have more while there is room."""
PATIENCE = 20.0
"""Seconds after which a connection that has not finished a request is closed: idle, slow, or not reading its answer."""
BUSY_DELAY = 1.0
"""Seconds before a client that asks too much is answered so."""
MAX_BODY = 4096
"""Bytes of a request's body."""
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; object-src 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
    "Server": "gatewayd",
}
"""Go with every answer."""
MAX_PATH = 200
"""Characters of a path in the log."""
_READING = ("GET", "HEAD")
_SWEEP = 2.0

log = logging.getLogger("gatewayd.status")

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Doors:
    """Lets in at most `MAX_CONNECTIONS` connections to `server`, and shows out who wastes one or keeps others out."""

    def __init__(self, server: web.Server) -> None:
        self._server = server
        self._seen: dict[RequestHandler, float] = {}
        """Connections with the time of their last finished request, or of their beginning."""

    def __call__(self) -> asyncio.Protocol:
        """The protocol of a new connection, before it is known whose it is."""
        return _Entrance(self)

    def come_in(self, transport: asyncio.Transport) -> None:
        """A peer has connected: it is served, or its connection is closed at once."""
        self._forget_closed()
        if len(self._seen) >= MAX_CONNECTIONS and not self._make_room(_peer(transport)):
            transport.abort()
            return
        handler = self._server()
        transport.set_protocol(handler)
        handler.connection_made(transport)
        self._seen[handler] = clock.now()

    def finished(self, handler: RequestHandler) -> None:
        """A request of the connection was answered."""
        if handler in self._seen:
            self._seen[handler] = clock.now()

    async def sweep(self) -> None:
        """Close what wastes a connection, until cancelled."""
        while True:
            await asyncio.sleep(_SWEEP)
            self._forget_closed()
            now = clock.now()
            for handler in [handler for handler, seen in self._seen.items() if now - seen > PATIENCE]:
                transport = handler.transport
                if transport is not None:
                    transport.abort()

    def _make_room(self, peer: object) -> bool:
        """The peer with the most connections, if they are more than `FAIR`, loses the one answered longest ago.

        Only to one who has fewer than that, so that nobody drives out himself again and again.
        """
        of_peer: defaultdict[object, list[RequestHandler]] = defaultdict(list)
        for handler in self._seen:
            of_peer[_peer(handler.transport)].append(handler)
        most = max(of_peer.values(), key=len)
        if len(most) <= FAIR or len(of_peer[peer]) >= FAIR:
            return False
        longest = min(most, key=self._seen.__getitem__)
        del self._seen[longest]
        assert longest.transport is not None
        longest.transport.abort()
        return True

    def _forget_closed(self) -> None:
        for handler in [handler for handler in self._seen if handler.transport is None]:
            del self._seen[handler]


class _Entrance(asyncio.Protocol):
    """A connection until it is made."""

    def __init__(self, doors: Doors) -> None:
        self._doors = doors

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._doors.come_in(cast("asyncio.Transport", transport))


def _peer(transport: asyncio.BaseTransport | None) -> object:
    """The address of the other side."""
    name = transport.get_extra_info("peername") if transport is not None else None
    return name and name[0]


def is_local_name(host: str) -> bool:
    """Whether a Host header names an address or this machine, so that no other site's name was led here."""
    name = host.rpartition(":")[0] if not host.endswith("]") and ":" in host else host
    name = name.strip("[]").lower()
    if name == "localhost" or name.endswith(".localhost"):
        return True
    try:
        ip_address(name)
    except ValueError:
        return False
    return True


def middleware(
    token: str | None, doors: Callable[[], Doors | None], share: LoopShare, *, local_only: bool
) -> Middleware:
    """Asks for the token, has who reads wait for his turn, answers errors in one line, adds `HEADERS`.

    With `local_only` the Host header has to be local: a page from elsewhere in a browser on this machine could
    otherwise read along under its own name (DNS rebinding).
    """

    @web.middleware
    async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
        refusal = _refusal(request, token, local_only=local_only)
        try:
            if refusal is not None or request.method in _READING:
                await share.request(asker(request))
            if request.transport is None:
                return _plain(503, "gone while waiting")  # nobody reads it, and nothing is done for it
            response = _plain(*refusal) if refusal is not None else await _answer(request, handler)
        except Busy:
            await asyncio.sleep(BUSY_DELAY)  # who asks again at once would cost more than what was refused
            response = _plain(503, "too many requests at once: try again later, and less often")
        for name, value in HEADERS.items():
            response.headers.setdefault(name, value)
        entrance = doors()
        if entrance is not None:
            entrance.finished(request.protocol)
        return response

    return guard


def _refusal(request: web.Request, token: str | None, *, local_only: bool) -> tuple[int, str] | None:
    if local_only and not is_local_name(request.host):
        return 421, "ask for 127.0.0.1 or localhost; a proxy must set the Host header to it"
    if request.method in _READING:
        return None
    if token is None:
        return 403, "reading only: the gateway was started without --token-file"
    given = request.headers.get("Authorization", "").removeprefix("Bearer ")
    if not hmac.compare_digest(given.encode("utf-8", "surrogateescape"), token.encode()):
        log.warning(
            "a request without the right token",
            extra=fields(peer=request.remote, path=request.path[:MAX_PATH]),
        )
        return 401, "this needs the token: Authorization: Bearer TOKEN"
    return None


async def _answer(request: web.Request, handler: Handler) -> web.StreamResponse:
    try:
        return await handler(request)
    except web.HTTPException as error:
        response = _plain(error.status, error.reason)
        if "Allow" in error.headers:
            response.headers["Allow"] = error.headers["Allow"]
        return response
    except Busy:
        raise
    except Exception:
        log.exception("a request could not be answered", extra=fields(path=request.path))
        return _plain(500, "internal error, see the log of the gateway")


def _plain(status: int, text: str) -> web.Response:
    headers = {"WWW-Authenticate": "Bearer"} if status == 401 else {}
    return web.Response(status=status, text=text + "\n", headers=headers)
