"""A CAN bus between processes without a kernel's help: copies frames between its clients, which speak slcan over TCP.

Every frame goes to all clients but its sender, in the order in which it came; what else an adapter is told (open,
close, bit rate) is nobody's business here.
"""

from __future__ import annotations

import asyncio
import sys

FRAMES = (b"t", b"T", b"r", b"R")
"""Lines that are frames: data and remote ones, with identifiers of 11 and of 29 bits."""
BACKLOG = 4 << 20
"""Bytes that may wait for a client before it is thrown off the bus."""

_clients: set[asyncio.StreamWriter] = set()


async def _serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    _clients.add(writer)
    try:
        while True:
            line = await reader.readuntil(b"\r")
            if line.startswith(FRAMES):
                for other in _clients - {writer}:
                    other.write(line)
                    if other.transport.get_write_buffer_size() > BACKLOG:
                        other.transport.abort()
    except (asyncio.IncompleteReadError, ConnectionError):
        pass
    finally:
        _clients.discard(writer)
        writer.close()


async def main() -> None:
    server = await asyncio.start_server(_serve, sys.argv[1], int(sys.argv[2]))
    print("carrying", flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main())
