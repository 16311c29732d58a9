"""The dashboard server of a simulated controller on a TCP port: sockets, and nothing else."""

from __future__ import annotations

import asyncio
import logging
from typing import cast

from gatewayd.simulator.dashboard import GREETING, PolyScope

DEFAULT_PORT = 29999
MAX_CONNECTIONS = 8
_MOST = 1024  # bytes of a line

_log = logging.getLogger(__name__)


class DashboardServer:
    """Serves one `PolyScope`. `port` 0 takes a free one, which is kept over `stop` and `start`."""

    def __init__(self, polyscope: PolyScope, host: str = "127.0.0.1", port: int = 0) -> None:
        self.polyscope = polyscope
        self.host, self.port = host, port
        self.silent = False
        """Fault: nothing is answered, and nobody greeted."""
        self.heard: list[str] = []
        """The last lines of clients."""
        self._server: asyncio.Server | None = None
        self._connections: set[_Connection] = set()

    @property
    def started(self) -> bool:
        """Whether it has listened."""
        return self._server is not None

    @property
    def clients(self) -> int:
        """Clients connected now."""
        return len(self._connections)

    async def start(self) -> None:
        """Listen. OSError if the address cannot be had."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: _Connection(self), self.host, self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def stop(self) -> None:
        """Close everything."""
        if self._server is not None:
            self._server.close()
        self.drop_clients()
        await asyncio.sleep(0)

    def drop_clients(self) -> int:
        """Cut every connection; returns how many there were."""
        connections = list(self._connections)
        for connection in connections:
            connection.abort()
        return len(connections)

    def enter(self, connection: _Connection) -> bool:
        """Note a new connection; False if there are too many, or if it was accepted just before the end."""
        if self._server is None or not self._server.is_serving() or self.clients >= MAX_CONNECTIONS:
            return False
        self._connections.add(connection)
        return True

    def leave(self, connection: _Connection) -> None:
        """Forget a connection."""
        self._connections.discard(connection)

    def note(self, line: str) -> None:
        """Remember what a client said."""
        self.heard.append(line)
        del self.heard[:-_MOST]


class _Connection(asyncio.Protocol):
    """One client's socket."""

    def __init__(self, server: DashboardServer) -> None:
        self._server = server
        self._buffer = b""
        self._allowed = server.polyscope.remote

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        if not self._server.enter(self):
            self.abort()
            return
        self._say(GREETING)

    def data_received(self, data: bytes) -> None:
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        if len(self._buffer) > _MOST:
            self.abort()
            return
        for each in lines:
            line = each.decode("utf-8", "replace").strip()
            self._server.note(line)
            answer = self._server.polyscope.answer(line, allowed=self._allowed)
            level = logging.DEBUG if self._server.polyscope.is_question(line) else logging.INFO
            _log.log(level, "dashboard: %s: %s", line, answer)
            self._say(answer)
            if line.lower() == "quit":
                self._transport.close()
                return

    def connection_lost(self, exc: Exception | None) -> None:
        self._server.leave(self)

    def abort(self) -> None:
        """Cut the connection at once."""
        self._transport.abort()

    def _say(self, line: str) -> None:
        if not self._server.silent and not self._transport.is_closing():
            self._transport.write(f"{line}\n".encode())
