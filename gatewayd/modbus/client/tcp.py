"""Lines on TCP: Modbus TCP, and RTU frames through a serial server."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from gatewayd.loop.connect import DeadPeer, connect
from gatewayd.modbus.client.conversation import Conversation, RtuConversation, TcpConversation
from gatewayd.modbus.client.line import Line
from gatewayd.modbus.client.runner import LineError, LineRunner
from gatewayd.modbus.client.timing import RtuTiming

SILENCE_LIMIT = 5.0
"""Seconds without any answer after which another connection is tried."""
_DEAD_PEER = DeadPeer(idle=5, interval=2, probes=3, unacknowledged=3000)
"""A device that was switched off is noticed after 11 s while nothing is underway, and after 3 s otherwise."""


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
        try:
            return await connect(lambda: _TcpChannel(self), self.address.host, self.address.port)
        except socket.gaierror as error:
            raise LineError(f"{self.address.host} has no address: {error.strerror or error}") from error
        except OSError as error:
            raise LineError(f"{self.address}: {_in_words(error)}") from error

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
        # Not before the connection: how long the attempt may take is the setting of the line.
        _DEAD_PEER.watch(transport.get_extra_info("socket"))

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
