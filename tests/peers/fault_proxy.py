"""A proxy between a Modbus TCP client and its server that spoils the answers of one unit. Standard library only.

Usage: fault_proxy.py ADDRESS PORT UNIT. Prints `listening PORT`, then does what lines of standard input say:

    ok             answers go through
    drop           they do not
    delay SECONDS  they come so much later; those of other units overtake them
    truncate       half of each comes, so that what follows is taken for its rest
    garble         one byte of each is another one: of its header, its length, its function, its data
"""

from __future__ import annotations

import asyncio
import random
import sys

_PREFIX = 6
_UNIT = 6


class _Faults:
    """What happens to the unit's answers now."""

    def __init__(self, unit: int) -> None:
        self.unit = unit
        self.kind = "ok"
        self.delay = 0.0
        self._random = random.Random(1)

    def order(self, line: str) -> None:
        self.kind, _, number = line.strip().partition(" ")
        self.delay = float(number or 0)

    def spoil(self, frame: bytes) -> tuple[bytes, float]:
        """What to send instead, and after how many seconds."""
        if frame[_UNIT] != self.unit or self.kind == "ok":
            return frame, 0.0
        if self.kind == "drop":
            return b"", 0.0
        if self.kind == "delay":
            return frame, self.delay
        if self.kind == "truncate":
            return frame[: len(frame) // 2], 0.0
        spoilt = bytearray(frame)
        place = self._random.randrange(len(frame))
        spoilt[place] ^= self._random.randrange(1, 256)
        return bytes(spoilt), 0.0


async def _forward(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(4096):
        writer.write(data)
    writer.close()


async def _answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, faults: _Faults) -> None:
    loop = asyncio.get_running_loop()
    try:
        while True:
            head = await reader.readexactly(_PREFIX)
            frame = head + await reader.readexactly(int.from_bytes(head[4:6], "big"))
            data, delay = faults.spoil(frame)
            if delay:
                loop.call_later(delay, writer.write, data)
            else:
                writer.write(data)
    except asyncio.IncompleteReadError:
        writer.close()


async def _listen(address: str, port: int, faults: _Faults) -> None:
    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            back, forth = await asyncio.open_connection(address, port)
            await asyncio.gather(_forward(reader, forth), _answer(back, writer, faults))
        except OSError:
            writer.close()

    server = await asyncio.start_server(serve, address, 0)
    print("listening", server.sockets[0].getsockname()[1], flush=True)
    loop = asyncio.get_running_loop()
    ended = loop.create_future()

    def obey() -> None:
        line = sys.stdin.readline()
        if line:
            faults.order(line)
            print("done", flush=True)
        elif not ended.done():
            ended.set_result(None)

    loop.add_reader(sys.stdin, obey)
    async with server:
        await ended


if __name__ == "__main__":
    asyncio.run(_listen(sys.argv[1], int(sys.argv[2]), _Faults(int(sys.argv[3]))))
