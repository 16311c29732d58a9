"""Connections to the status listener: how many, for how long, from whom, and the TLS handshake in front of HTTP.

A handshake is the most costly thing that an unknown peer can ask for: a signature. It waits for its turn in the share
of the loop that all requests have together, so that a flood of them takes from other requests and from no PLC.
"""

from __future__ import annotations

import asyncio
import logging
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from ssl import SSLContext
from typing import cast

from aiohttp import web
from aiohttp.web_protocol import RequestHandler

from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.share import Busy, LoopShare
from gatewayd.web.access_control import AccessControl
from gatewayd.web.encryption import HANDSHAKE_TIME
from gatewayd.web.hosts import network_of, normal_address

MAX_CONNECTIONS = 32
"""Open at a time; further ones are closed at once, so that a flood costs the robot's loop next to nothing."""
FAIR = 8
"""Connections of one peer that nobody takes from it. It may have more while there is room."""
UNKNOWN_TIME = 2.0
"""Seconds that a connection has for a request with a token, before it may lose its place to a newcomer."""
PATIENCE = 20.0
"""Seconds after which a connection that has not finished a request is closed: idle, slow, or not reading its answer."""
_SWEEP = 2.0
_GOODBYE = 1.0
"""Seconds for the end of TLS."""
_MAX_EARLY = 64 * 1024
"""Bytes of a request that may come in the same moment as the end of the handshake."""

log = logging.getLogger("gatewayd.status")


class Doors:
    """Lets in at most `MAX_CONNECTIONS` connections to `server`, and shows out who wastes one or keeps others out."""

    def __init__(self, server: web.Server, access: AccessControl, share: LoopShare) -> None:
        self._server = server
        self._access = access
        self._share = share
        self._seen: dict[_Visit, float] = {}
        """Connections with the time of their last finished request, or of their beginning."""
        self._handshakes: set[asyncio.Task[None]] = set()

    def __call__(self) -> asyncio.Protocol:
        """The protocol of a new connection, before it is known whose it is."""
        return _Visit(self.come_in)

    def come_in(self, visit: _Visit) -> None:
        """A peer has connected: it is served, or its connection is closed at once."""
        transport = visit.transport
        assert transport is not None
        self._forget_closed()
        if not self._is_awaited(visit.peer):
            self._access.refused["peer"] += 1
            transport.abort()
            return
        if len(self._seen) >= MAX_CONNECTIONS and not self._make_room(visit.peer):
            transport.abort()
            return
        self._seen[visit] = visit.begun
        if self._access.identity is None:
            visit.serve(self._server(), transport)
            return
        transport.pause_reading()
        task = asyncio.get_running_loop().create_task(self._encrypt(visit, transport))
        self._handshakes.add(task)
        task.add_done_callback(self._handshakes.discard)

    def got_on(self, handler: RequestHandler, *, is_known: bool) -> None:
        """A request of the connection was answered, or a part of an answer without end; `is_known`: with a token."""
        for visit in self._seen:
            if visit.handler is handler:
                self._seen[visit] = clock.now()
                visit.is_known = is_known

    async def sweep(self) -> None:
        """Close what wastes a connection, until cancelled."""
        while True:
            await asyncio.sleep(_SWEEP)
            self._forget_closed()
            now = clock.now()
            for visit in [visit for visit, seen in self._seen.items() if now - seen > PATIENCE]:
                visit.abort()

    def close(self) -> None:
        """End what is not served yet."""
        for task in self._handshakes:
            task.cancel()
        for visit in self._seen:
            if visit.handler is None:
                visit.abort()

    def _is_awaited(self, peer: str) -> bool:
        """Whether this peer may connect: without TLS, and with a proxy in front, only that one."""
        settings = self._access.settings
        if settings.proxy is None or settings.tls is not None:
            return True
        return peer == normal_address(settings.proxy)

    async def _encrypt(self, visit: _Visit, transport: asyncio.Transport) -> None:
        identity, loop = self._access.identity, asyncio.get_running_loop()
        assert identity is not None
        try:
            await self._share.request(visit.peer, self._access.handshake_cost)
            context = cast("SSLContext", identity.context)  # the listener is not opened before there is one
            if transport.is_closing():
                return
            secure = await loop.start_tls(
                transport,
                visit,
                context,
                server_side=True,
                ssl_handshake_timeout=HANDSHAKE_TIME,
                ssl_shutdown_timeout=_GOODBYE,
            )
        except (OSError, Busy) as error:
            self._access.refused["handshake"] += 1
            log.debug("no TLS handshake", extra=fields(peer=visit.peer, reason=str(error)))
            transport.abort()
            return
        except asyncio.CancelledError:
            transport.abort()
            raise
        if secure is not None and not visit.is_closed:
            visit.serve(self._server(), secure)

    def _make_room(self, peer: str) -> bool:
        """The peer with the most connections, if they are more than `FAIR`, loses the one answered longest ago.

        Only to one who has fewer than that, so that nobody drives out himself again and again. Where nobody has
        more, many may keep others out together: then one goes that has not shown a token in time.
        """
        of_peer: defaultdict[str, list[_Visit]] = defaultdict(list)
        for visit in self._seen:
            of_peer[network_of(visit.peer)].append(visit)
        most = max(of_peer.values(), key=len)
        if len(of_peer[network_of(peer)]) >= FAIR:
            return False
        leaving_one_of = most if len(most) > FAIR else list(filter(self._is_unknown, self._seen))
        if not leaving_one_of:
            return False
        leaving = min(leaving_one_of, key=self._seen.__getitem__)
        del self._seen[leaving]
        leaving.abort()
        return True

    def _is_unknown(self, visit: _Visit) -> bool:
        """Whether it has shown no token for so long that it need not have come. On this machine none is needed."""
        since = self._seen[visit] if self._access.settings.is_local else visit.begun
        return not visit.is_known and clock.now() - since >= UNKNOWN_TIME

    def _forget_closed(self) -> None:
        for visit in [visit for visit in self._seen if visit.is_closed]:
            del self._seen[visit]


class _Visit(asyncio.Protocol):
    """One connection. It is its protocol until HTTP is: with TLS, until the handshake is done."""

    def __init__(self, come_in: Callable[[_Visit], None]) -> None:
        self.transport: asyncio.Transport | None = None
        self.handler: RequestHandler | None = None
        self.peer = ""
        self.begun = clock.now()
        self.is_known = False
        """Whether its last request came with a token that counts."""
        self._come_in = come_in
        self._is_lost = False
        self._early = bytearray()

    @property
    def is_closed(self) -> bool:
        """Whether the connection has ended."""
        return self._is_lost if self.handler is None else self.handler.transport is None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast("asyncio.Transport", transport)
        name = transport.get_extra_info("peername")
        self.peer = normal_address(str(name[0])) if name else ""
        self._come_in(self)

    def data_received(self, data: bytes) -> None:
        """The handshake is done, and `_encrypt` has not had its turn yet."""
        self._early += data
        if len(self._early) > _MAX_EARLY:
            self.abort()

    def connection_lost(self, error: Exception | None) -> None:
        self._is_lost = True

    def serve(self, handler: RequestHandler, transport: asyncio.Transport) -> None:
        """HTTP from now on."""
        self.transport, self.handler = transport, handler
        transport.set_protocol(handler)
        handler.connection_made(transport)
        if self._early:
            handler.data_received(bytes(self._early))
            self._early.clear()

    def abort(self) -> None:
        """End it at once."""
        transport = self.transport if self.handler is None else self.handler.transport
        if transport is not None:
            with suppress(OSError):
                transport.abort()
