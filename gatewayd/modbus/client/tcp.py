"""Lines on TCP: Modbus TCP, and RTU frames through a serial server."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from gatewayd.loop.resolve import resolve
from gatewayd.modbus.client.conversation import Conversation, RtuConversation, TcpConversation
from gatewayd.modbus.client.line import Line
from gatewayd.modbus.client.runner import LineError, LineRunner
from gatewayd.modbus.client.timing import RtuTiming

SILENCE_LIMIT = 5.0
"""Seconds without any answer after which another connection is tried."""
_UNACKNOWLEDGED = 3000
"""Milliseconds after which the kernel gives up what the peer does not acknowledge (RFC 5482).

Otherwise the pauses between its repetitions grow to minutes, and a device that was off would be found as late."""
_KEEPALIVE = (
    (socket.TCP_KEEPIDLE, 5),
    (socket.TCP_KEEPINTVL, 2),
    (socket.TCP_KEEPCNT, 3),
)
"""Seconds of silence, seconds between probes of the kernel, and how many of them: 11 s for a peer that is gone."""


class TcpFrames(Enum):
    """What goes over the connection."""

    MODBUS_TCP = "Modbus TCP"
    RTU = "RTU over TCP"


@dataclass(frozen=True, slots=True)
class TcpAddress:
    """Where the units are."""

    host: str
    """Name or address."""
    port: int = 502
    frames: TcpFrames = TcpFrames.MODBUS_TCP

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


class TcpLine(LineRunner):
    """A line on a TCP connection."""

    def __init__(
        self, address: TcpAddress, line: Line, report: Callable[[str], object] = lambda _reason: None
    ) -> None:
        super().__init__(line, report)
        self.address = address
        line.silence_limit = SILENCE_LIMIT

    async def open(self) -> _TcpChannel:
        """See LineRunner."""
        loop = asyncio.get_running_loop()
        try:
            addresses = await resolve(self.address.host, self.address.port)
        except OSError as error:
            raise LineError(f"{self.address.host} has no address: {error.strerror or error}") from error
        problem: OSError | None = None
        for family, _, _, address in addresses:
            try:
                _, channel = await loop.create_connection(
                    lambda: _TcpChannel(self), str(address[0]), int(address[1]), family=family
                )
            except OSError as error:
                problem = error
            else:
                return channel
        assert problem is not None
        raise LineError(f"{self.address}: {_in_words(problem)}") from problem

    def make_conversation(self) -> Conversation:
        """See LineRunner."""
        if self.address.frames is TcpFrames.RTU:
            return RtuConversation(RtuTiming.behind_server())
        return TcpConversation(self.line.settings.in_flight)


class _TcpChannel(asyncio.Protocol):
    """The connection as asyncio's protocol."""

    def __init__(self, runner: LineRunner) -> None:
        self._runner: LineRunner | None = runner
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """See asyncio.Protocol."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        connection = transport.get_extra_info("socket")
        # asyncio has set TCP_NODELAY. Keep-alive notices a peer that was switched off while nothing is underway.
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for option, value in (*_KEEPALIVE, (socket.TCP_USER_TIMEOUT, _UNACKNOWLEDGED)):
            connection.setsockopt(socket.IPPROTO_TCP, option, value)

    def data_received(self, data: bytes) -> None:
        """See asyncio.Protocol."""
        if self._runner is not None:
            self._runner.received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """See asyncio.Protocol."""
        if self._runner is not None:
            runner, self._runner = self._runner, None
            text = "" if exc is None else getattr(exc, "strerror", None) or str(exc)
            runner.ended(f"the connection broke: {text}" if text else "the device has closed the connection")

    def send(self, data: bytes) -> None:
        """See Channel."""
        assert self._transport is not None
        self._transport.write(data)

    def close(self) -> None:
        """See Channel. Aborted, because what was underway is of no interest any more."""
        self._runner = None
        if self._transport is not None:
            self._transport.abort()


def _in_words(error: OSError) -> str:
    """What the system says, without the address that asyncio writes before it."""
    return os.strerror(error.errno) if error.errno else str(error)
