"""A controller gone mad: a proper set-up up to some point, and then bytes that are RTDE only by half or not at all.

python -m tests.e2e.hostile_controller HOST PORTS SEED
    Prints the ports it listens on; on a line of standard input how many cases there were so far.
"""

from __future__ import annotations

import asyncio
import random
import struct
import sys
from contextlib import suppress

_HEAD = struct.Struct(">HB")
_MOST_MESSAGES = 300


class HostileController:
    """Answers the requests of one connection after the other, each time in another wrong way."""

    def __init__(self, seed: int) -> None:
        self.cases = 0
        self.connections = 0
        self._chance = random.Random(seed)
        self._writers: set[asyncio.StreamWriter] = set()

    async def start(self, host: str, port: int = 0) -> asyncio.Server:
        return await asyncio.start_server(self._serve, host, port)

    def cut_connections(self) -> None:
        for writer in self._writers:
            writer.transport.abort()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        self._writers.add(writer)
        with suppress(OSError, asyncio.IncompleteReadError):
            await self._talk(reader, writer)
        self._writers.discard(writer)
        writer.transport.abort()

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        chance = self._chance
        proper = chance.choice((0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 12, 12))
        """Requests that are answered as they should be."""
        while True:
            size, kind = _HEAD.unpack(await reader.readexactly(_HEAD.size))
            payload = await reader.readexactly(size - _HEAD.size)
            if kind == ord("U"):
                continue
            answer = self._answer(kind, payload)
            if proper == 0:
                self.cases += 1
                writer.write(self._wrong(answer))
                if chance.random() < 0.7:
                    await writer.drain()
                    return
                continue
            proper -= 1
            if kind == ord("O") and chance.random() < 0.3:
                answer = answer[:3] + bytes(1) + answer[4:]  # the list is too long: read in pieces
            writer.write(answer)
            if kind == ord("S"):
                await self._stream(writer, payload)
                return

    def _answer(self, kind: int, payload: bytes) -> bytes:
        """The proper one."""
        names = payload[8:] if kind == ord("O") else payload
        types = ",".join(self._type(name) for name in names.decode("ascii", "replace").split(","))
        return self._message(
            {
                ord("V"): b"V\x01",
                ord("v"): b"v" + struct.pack(">4I", 5, 12, 0, 1101),
                ord("O"): b"O\x01" + types.encode(),
                ord("I"): b"I\x01" + types.encode(),
            }.get(kind, bytes((kind, 1)))
        )

    def _type(self, name: str) -> str:
        if "bit_registers" in name:
            return "UINT32"
        if "int_register" in name:
            return "INT32"
        return "DOUBLE"

    def _message(self, body: bytes) -> bytes:
        return struct.pack(">H", len(body) + 2) + body

    def _wrong(self, answer: bytes) -> bytes:
        chance = self._chance
        kind = chance.randrange(10)
        if kind == 8:
            return answer[:3] + bytes(1) + answer[4:]  # refused, and no field to blame
        if kind == 9:
            return self._package() + answer
        if kind == 0:
            return chance.randbytes(chance.choice((1, 2, 3, 50, 5000)))
        if kind == 1:
            return struct.pack(">HB", chance.randrange(4), answer[2])
        if kind == 2:
            return answer[: chance.randrange(len(answer))]
        if kind == 3:
            return self._message(answer[2:3] + chance.randbytes(chance.randrange(60)))
        if kind == 4:
            return self._message(answer[2:] + b",DOUBLE" * chance.choice((1, 3, 9000)))
        if kind == 5:
            return self._message(
                answer[2:].replace(b"DOUBLE", chance.choice((b"BOGUS", b"NOT_FOUND", b"IN_USE", b"")))
            )
        if kind == 6:
            return answer * chance.randrange(2, 9)
        data = bytearray(answer)
        data[chance.randrange(len(data))] = chance.randrange(256)
        return bytes(data)

    async def _stream(self, writer: asyncio.StreamWriter, _start: bytes) -> None:
        """Packages and texts, most of them wrong; the client decides when it has had enough."""
        for _ in range(_MOST_MESSAGES):
            self.cases += 1
            writer.write(self._package())
            await writer.drain()
            if self._chance.random() < 0.02:
                await asyncio.sleep(0.001)

    def _package(self) -> bytes:
        """Mostly what a client has to put up with, seldom what it must not."""
        chance = self._chance
        kind = chance.randrange(60)
        if kind == 0:
            return chance.randbytes(chance.randrange(1, 400))
        if kind == 1:
            return self._message(b"U" + chance.randbytes(chance.randrange(100)))
        if kind == 2:
            return self._message(chance.randbytes(chance.randrange(1, 60)))
        if kind < 20:
            text = chance.randbytes(chance.randrange(256))
            source = chance.randbytes(chance.randrange(20))
            body = bytes((len(text),)) + text + bytes((len(source),)) + source + chance.randbytes(1)
            return self._message(b"M" + body)
        if kind < 40:
            return self._message(
                b"U" + bytes((chance.randrange(2, 256),)) + chance.randbytes(chance.randrange(60))
            )
        values = (self.cases * 0.002, chance.choice((0.0, 5e-324, -1e308, float("nan"), float("inf"))))
        return self._message(b"U\x01" + struct.pack(">dd", *values) + chance.randbytes(4))


async def serve(host: str, ports: int, seed: int) -> None:
    controllers = [HostileController(seed + number) for number in range(ports)]
    servers = [await controller.start(host) for controller in controllers]
    print(*(server.sockets[0].getsockname()[1] for server in servers), flush=True)
    lines = asyncio.StreamReader()
    loop = asyncio.get_running_loop()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(lines), sys.stdin)
    while await lines.readline():
        print(
            sum(controller.cases for controller in controllers),
            sum(controller.connections for controller in controllers),
            flush=True,
        )


if __name__ == "__main__":
    asyncio.run(serve(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
