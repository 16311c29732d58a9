"""A Modbus TCP server of the tests' own, on the test's loop, that does to its connections what a test wants."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from gatewayd.modbus.frames import encode, split
from tests.modbus.client.world import Unit

HOST = "127.0.0.1"
PATIENCE = 10.0


class Server:
    """Serves one unit's answers; `closes_after` requests it closes the connection."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit
        self.port = 0
        self.accepted = 0
        self.closes_after = 1_000_000
        self._server: asyncio.Server | None = None
        self._writers: list[asyncio.StreamWriter] = []

    async def start(self) -> None:
        """Listen, on the same port as before if there was one."""
        self._server = await asyncio.start_server(self._serve, HOST, self.port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def stop(self) -> None:
        """Close everything."""
        if self._server is not None:
            self._server.close()
            self.drop()

    def drop(self) -> None:
        """Break all connections."""
        while self._writers:
            self._writers.pop().transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.accepted += 1
        self._writers.append(writer)
        served = 0
        buffer = bytearray()
        while data := await reader.read(1000):
            buffer += data
            while (request := split(buffer, 0, len(buffer))) is not None:
                del buffer[: request.end]
                answer = self.unit.answer(request.pdu)
                if answer is not None:
                    writer.write(encode(request.transaction, request.unit, answer))
                served += 1
                if served >= self.closes_after:
                    writer.close()
                    return


@asynccontextmanager
async def serving() -> AsyncIterator[Server]:
    """A server that runs."""
    server = Server(Unit())
    await server.start()
    try:
        yield server
    finally:
        await server.stop()


@asynccontextmanager
async def running(line: object) -> AsyncIterator[None]:
    """The line's task, cancelled at the end; what it raises is raised."""
    task = asyncio.ensure_future(line.run())  # type: ignore[attr-defined]
    try:
        yield
        assert not task.done(), task.exception()
    finally:
        task.cancel()
        await asyncio.wait([task])
