"""Readers of the status listener that ask for one path as fast as they are answered.

python -m tests.e2e.http_readers HOST PORT PATH READERS SECONDS
    Print `begun` when each has had an answer, and in the end the number of all answers.
"""

from __future__ import annotations

import asyncio
import sys
import time

_PATIENCE = 20.0


class _Readers:
    def __init__(self, host: str, port: int, path: str) -> None:
        self._host, self._port = host, port
        self._request = f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode()
        self.answers = 0

    async def read(self, end: float, begun: asyncio.Barrier) -> None:
        """Ask until `end`."""
        reader, writer = await asyncio.open_connection(self._host, self._port)
        await self._ask(reader, writer)
        await begun.wait()
        while time.monotonic() < end:
            await self._ask(reader, writer)
        writer.close()

    async def _ask(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(self._request)
        async with asyncio.timeout(_PATIENCE):
            head = await reader.readuntil(b"\r\n\r\n")
            assert head.startswith(b"HTTP/1.1 200"), head
            length = head.lower().partition(b"content-length: ")[2].partition(b"\r\n")[0]
            await reader.readexactly(int(length))
        self.answers += 1


async def _main(host: str, port: str, path: str, count: str, seconds: str) -> None:
    readers, begun = _Readers(host, int(port), path), asyncio.Barrier(int(count) + 1)
    end = time.monotonic() + float(seconds)
    async with asyncio.TaskGroup() as group:
        for _ in range(int(count)):
            group.create_task(readers.read(end, begun))
        await begun.wait()
        print("begun", flush=True)
    print(readers.answers, flush=True)


if __name__ == "__main__":
    asyncio.run(_main(*sys.argv[1:]))
