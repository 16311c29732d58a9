"""Connections: how many, whose, for how long, and TLS in front of HTTP, over real sockets."""

from __future__ import annotations

import asyncio

import pytest

from gatewayd.web import doors
from gatewayd.web.listener import StatusListener
from tests.web.press import TOKEN

HEALTHZ = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
HEALTHZ_ONCE = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"


async def raw(port: int, request: bytes) -> bytes:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(request)
    try:
        return await asyncio.wait_for(reader.read(), 10)
    except ConnectionError:
        return b""
    finally:
        writer.close()


async def connect(listener: StatusListener, source: str) -> asyncio.StreamWriter:
    _, writer = await asyncio.open_connection("127.0.0.1", listener.port, local_addr=(source, 0))
    return writer


async def test_connections_are_bounded_and_come_back(listener: StatusListener) -> None:
    sources = [f"127.0.0.{2 + number // doors.FAIR}" for number in range(doors.MAX_CONNECTIONS)]
    many = [await connect(listener, source) for source in sources]
    await asyncio.sleep(0.05)
    assert await raw(listener.port, HEALTHZ_ONCE) == b""
    for writer in many:
        writer.close()
    async with asyncio.timeout(10):
        while not (await raw(listener.port, HEALTHZ_ONCE)).startswith(b"HTTP/1.1 200"):  # noqa: ASYNC110 - nobody signals it
            await asyncio.sleep(0.02)


async def test_many_peers_without_a_token_keep_nobody_out_together(
    listener: StatusListener, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody of them has more than its share, and each holds what it has: then who has shown no token goes."""
    monkeypatch.setattr(doors, "UNKNOWN_TIME", 0.2)
    reader, known = await asyncio.open_connection("127.0.0.1", listener.port, local_addr=("127.0.0.9", 0))
    known.write(HEALTHZ.replace(b"\r\n\r\n", b"\r\nAuthorization: Bearer " + TOKEN.encode() + b"\r\n\r\n"))
    assert (await asyncio.wait_for(reader.readuntil(b"}"), 10)).startswith(b"HTTP/1.1 200")
    sources = [f"127.0.0.{2 + number // doors.FAIR}" for number in range(doors.MAX_CONNECTIONS - 1)]
    many = [await connect(listener, source) for source in sources]
    assert await raw(listener.port, HEALTHZ_ONCE) == b""
    async with asyncio.timeout(10):
        while not (await raw(listener.port, HEALTHZ_ONCE)).startswith(b"HTTP/1.1 200"):  # noqa: ASYNC110 - nobody signals it
            await asyncio.sleep(0.02)
    known.write(HEALTHZ)
    assert b"200 OK" in await asyncio.wait_for(reader.readuntil(b"}"), 10)
    for writer in (known, *many):
        writer.close()


async def test_one_peer_keeps_nobody_out(listener: StatusListener) -> None:
    """However many connections it has and makes anew: what it has too much goes, and others' stay."""
    many = [await connect(listener, "127.0.0.2") for _ in range(2 * doors.MAX_CONNECTIONS)]
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port, local_addr=("127.0.0.3", 0))
    for _ in range(5):
        writer.write(HEALTHZ)
        assert (await asyncio.wait_for(reader.readuntil(b"}"), 10)).startswith(b"HTTP/1.1 200")
        many += [await connect(listener, "127.0.0.2") for _ in range(doors.MAX_CONNECTIONS)]
    for connection in (writer, *many):
        connection.close()


async def test_who_has_many_connections_does_not_drive_out_himself(listener: StatusListener) -> None:
    """Those that were first are served, whatever else the same peer tries."""
    reader, writer = await asyncio.open_connection("127.0.0.1", listener.port, local_addr=("127.0.0.2", 0))
    many = [await connect(listener, "127.0.0.2") for _ in range(3 * doors.MAX_CONNECTIONS)]
    writer.write(HEALTHZ)
    assert (await asyncio.wait_for(reader.readuntil(b"}"), 10)).startswith(b"HTTP/1.1 200")
    for connection in (writer, *many):
        connection.close()


async def test_who_wastes_a_connection_is_shown_out(
    listener: StatusListener, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doors, "PATIENCE", 0.1)
    assert await raw(listener.port, b"GET / HTTP/1.1\r\nHost: slow") == b""
