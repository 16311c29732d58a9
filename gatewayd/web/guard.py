"""What stands between the status listener and all that reach its port: names, tokens, roles, headers, turns.

Nothing but the page's own files and two words of health is free beyond this machine. No answer ever carries a
traceback, and no token is ever in the log.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Collection
from dataclasses import dataclass

from aiohttp import web
from aiohttp.typedefs import Middleware

from gatewayd.control.access import Caller
from gatewayd.control.server import CALLER, CALLER_NOW, GOT_ON, PEER, REFUSED, asker
from gatewayd.control.tokens import without_tokens
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.share import Busy, LoopShare
from gatewayd.web.access_control import AccessControl
from gatewayd.web.credentials import ASK, Judgement, Unidentified
from gatewayd.web.doors import Doors
from gatewayd.web.hosts import forwarded_peer, is_from_elsewhere, is_ours, normal_address

BUSY_DELAY = 1.0
"""Seconds before a client that asks too much is answered so."""
MAX_DELAYED = 8
"""Wrong tokens whose answers wait at one time; further ones are told to come later."""
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
FREE = frozenset({"/healthz", "/readyz"})
"""Paths that anybody may ask, beside the page's files: short where the caller is not known."""
STREAMS = frozenset({"/api/v1/events"})
"""Paths of reading whose answer may have no end: a page of another site must not hold one open."""
_READING = ("GET", "HEAD")
_LOGGED = 4
"""Wrong tokens of a peer that are logged one by one; then each twice as many as the last."""
_JUDGED = {
    Judgement.NONE: "no_token",
    Judgement.WRONG: "wrong_token",
    Judgement.ENDED: "expired_token",
}

log = logging.getLogger("gatewayd.status")

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


@dataclass(frozen=True, slots=True)
class _Refusal:
    status: int
    text: str
    delay: float = 0.0
    """Seconds before it is answered."""


class Guard:
    """Judges every request to one listener. `page` are the paths of the page's files."""

    def __init__(self, access: AccessControl, page: Collection[str]) -> None:
        self._access = access
        self._free = FREE | frozenset(page)
        self._names = frozenset(access.settings.own_names)
        self._delayed = 0

    def judge(self, request: web.Request) -> _Refusal | None:
        """Why the request is refused; None: it is not, and who asks is in it (`CALLER`), if that is known."""
        peer = self._peer(request)
        request[PEER] = peer
        refusal = self._wrong_name(request) or self._foreign(request)
        if refusal is not None:
            return refusal
        credentials, reading = self._access.credentials, request.method in _READING
        header = request.headers.get("Authorization")
        if credentials is None and not reading:
            return _Refusal(403, "reading only: the gateway was started without --token-file")
        if credentials is not None and (header is not None or not reading):
            return self._unidentified(request, header, peer)
        if request.path in self._free or self._access.settings.is_local:
            return None
        self._access.refused["no_token"] += 1
        return _Refusal(401, ASK)

    def _count(self, reason: str) -> None:
        self._access.refused[reason] += 1

    async def wait(self, refusal: _Refusal) -> None:
        """Let a wrong token wait for its answer."""
        if refusal.delay:
            self._delayed += 1
            try:
                await asyncio.sleep(refusal.delay)
            finally:
                self._delayed -= 1

    def _peer(self, request: web.Request) -> str:
        """Who asks: the other end, or what the declared proxy says of it."""
        peer, proxy = normal_address(request.remote or ""), self._access.settings.proxy
        if proxy is None or peer != normal_address(proxy):
            return peer
        return forwarded_peer(request.headers.getall("X-Forwarded-For", [])) or peer

    def _wrong_name(self, request: web.Request) -> _Refusal | None:
        hosts = request.headers.getall("Host", [])
        if len(hosts) == 1 and is_ours(hosts[0], self._names, _own_addresses(request)):
            return None
        self._access.refused["host"] += 1
        if len(hosts) != 1:
            return _Refusal(400, "a request has exactly one Host header")
        return _Refusal(
            421,
            "this name is not one of the gateway's: ask for its address, or declare the name (--status-name)",
        )

    def _foreign(self, request: web.Request) -> _Refusal | None:
        if request.method in _READING and request.path not in STREAMS:
            return None
        headers = request.headers
        origins, sites = headers.getall("Origin", []), headers.getall("Sec-Fetch-Site", [])
        if is_from_elsewhere(origins, sites, headers["Host"]):
            self._access.refused["origin"] += 1
            return _Refusal(403, "this was sent by a page of another site")
        return None

    def _unidentified(self, request: web.Request, header: str | None, peer: str) -> _Refusal | None:
        """None: the caller is known, and noted in the request."""
        credentials = self._access.credentials
        assert credentials is not None
        if len(request.headers.getall("Authorization", [])) > 1:
            return _Refusal(400, "a request has at most one Authorization header")
        found = credentials.identify(header, peer, time.time())
        if isinstance(found, Caller):
            request[CALLER] = found
            request[REFUSED] = self._count
            request[CALLER_NOW] = lambda: credentials.current(found, time.time())
            return None
        self._access.refused[_JUDGED[found.judgement]] += 1
        if found.judgement is Judgement.NONE:
            return _Refusal(401, found.text)
        delay = self._wrong_token(request, peer, found)
        if self._delayed >= MAX_DELAYED:
            return _Refusal(429, "too many wrong tokens at once: try again later")
        return _Refusal(401, found.text, delay)

    def _wrong_token(self, request: web.Request, peer: str, found: Unidentified) -> float:
        """Another one, or one that counts no more: seconds that its answer waits."""
        count, delay = self._access.wrong_tokens.wrong(peer, clock.now())
        if count <= _LOGGED or count.bit_count() == 1:
            path = without_tokens(request.path[:MAX_PATH])
            if found.judgement is Judgement.WRONG:
                log.warning(
                    "a request without the right token", extra=fields(peer=peer, path=path, times=count)
                )
            else:
                log.warning(
                    "a token that counts no more",
                    extra=fields(peer=peer, path=path, reason=found.text, times=count),
                )
        return delay


def middleware(guard: Guard, doors: Callable[[], Doors | None], share: LoopShare) -> Middleware:
    """Has `guard` judge, has who reads wait for his turn, answers errors in one line, adds `HEADERS`."""

    @web.middleware
    async def guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
        refusal, entrance = guard.judge(request), doors()
        is_known = CALLER in request
        if entrance is not None:
            request[GOT_ON] = lambda: entrance.got_on(request.protocol, is_known=is_known)
        try:
            if refusal is not None or request.method in _READING:
                await share.request(asker(request))
            if refusal is not None:
                await guard.wait(refusal)
            if request.transport is None:
                return _plain(503, "gone while waiting")  # nobody reads it, and nothing is done for it
            response = (
                await _answer(request, handler) if refusal is None else _plain(refusal.status, refusal.text)
            )
        except Busy:
            await asyncio.sleep(BUSY_DELAY)  # who asks again at once would cost more than what was refused
            response = _plain(503, "too many requests at once: try again later, and less often")
        for name, value in HEADERS.items():
            response.headers.setdefault(name, value)
        if entrance is not None:
            request[GOT_ON]()
        return response

    return guarded


def _own_addresses(request: web.Request) -> tuple[str, ...]:
    """The address at which this connection reached us."""
    own = request.transport.get_extra_info("sockname") if request.transport is not None else None
    return (normal_address(str(own[0])),) if own else ()


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
    headers = {401: {"WWW-Authenticate": "Bearer"}, 429: {"Retry-After": "10"}}.get(status, {})
    return web.Response(status=status, text=text + "\n", headers=headers)
