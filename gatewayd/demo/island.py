"""A small I/O island: a Modbus TCP server that knows nothing of gatewayd. It has a clamp, and a sensor for parts.

Coil 0 closes the clamp. Discrete input 0 is on while a part lies there: it goes when the clamp opens, and the next one
comes a moment later. `Terminals` is the logic alone, requests in and answers out; `Island` is the server.
"""

from __future__ import annotations

import asyncio
import math
import struct
from collections import deque
from dataclasses import dataclass, field

from gatewayd.loop import clock

NEXT_PART = 0.3
"""Seconds from the clamp that opens to the next part."""

_HEADER = struct.Struct(">HHHB")
"""MBAP: transaction, protocol (0), bytes that follow, unit. Modbus Messaging on TCP/IP 1.0b, 3.1.3."""
_REQUEST = struct.Struct(">BHH")
"""Function, address, and a number or a value: what the four functions have that are served here."""
_READ_COILS, _READ_DISCRETE, _WRITE_COIL = 1, 2, 5
_NO_FUNCTION, _NO_ADDRESS = 1, 2
"""Exception codes."""
_ON, _OFF = 0xFF00, 0x0000
_MAX_PDU = 253


@dataclass
class Terminals:
    """The outputs and inputs of the island. Times are monotonic seconds."""

    clamp: bool = False
    closed: int = 0
    """Times that the clamp has closed."""
    requests: int = 0
    refused: int = 0
    """Requests that were answered with an exception."""
    _part_since: float = -math.inf
    _latest: deque[float] = field(default_factory=deque)

    def part_there(self, now: float) -> bool:
        """What the sensor sees."""
        return now >= self._part_since

    def rate(self, now: float) -> int:
        """Requests within the last second."""
        while self._latest and now - self._latest[0] > 1:
            self._latest.popleft()
        return len(self._latest)

    def answer(self, pdu: bytes, now: float) -> bytes:
        """The answer to a request."""
        self.requests += 1
        self._latest.append(now)
        self.rate(now)
        if len(pdu) != _REQUEST.size or pdu[0] not in (_READ_COILS, _READ_DISCRETE, _WRITE_COIL):
            return self._refusal(pdu, _NO_FUNCTION)
        function, address, value = _REQUEST.unpack(pdu)
        if address != 0 or (function != _WRITE_COIL and value != 1):
            return self._refusal(pdu, _NO_ADDRESS)
        if function == _WRITE_COIL:
            self._move(closes=value == _ON, now=now)
            return pdu
        is_on = self.clamp if function == _READ_COILS else self.part_there(now)
        return bytes([function, 1, is_on])

    def _refusal(self, pdu: bytes, code: int) -> bytes:
        self.refused += 1
        return bytes([(pdu[0] if pdu else 0) | 0x80, code])

    def _move(self, *, closes: bool, now: float) -> None:
        if closes and not self.clamp:
            self.closed += 1
        elif self.clamp and not closes:
            self._part_since = now + NEXT_PART
        self.clamp = closes


class Island:
    """The server, on a port of this machine."""

    def __init__(self, host: str, port: int) -> None:
        self.terminals = Terminals()
        self.connections = 0
        """Clients that are connected now."""
        self._host, self._port = host, port

    async def run(self) -> None:
        """Serve until cancelled."""
        server = await asyncio.start_server(self._serve, self._host, self._port)
        async with server:
            await server.serve_forever()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        try:
            while True:
                transaction, protocol, length, unit = _HEADER.unpack(await reader.readexactly(_HEADER.size))
                if protocol != 0 or not 1 < length <= _MAX_PDU + 1:
                    return
                answer = self.terminals.answer(await reader.readexactly(length - 1), clock.now())
                writer.write(_HEADER.pack(transaction, 0, len(answer) + 1, unit) + answer)
        except (asyncio.IncompleteReadError, ConnectionError):
            pass
        finally:
            self.connections -= 1
            writer.close()
