"""The sending side of a connection, over a real socket pair."""

from __future__ import annotations

import asyncio
import socket

from gatewayd.rtde.codec import ClientProtocol
from gatewayd.rtde.messages import GetControllerVersion
from gatewayd.rtde.sending import PackageSender


async def test_what_is_sent_arrives_and_is_shown_to_whoever_traces() -> None:
    near, far = socket.socketpair()
    far.setblocking(False)
    loop = asyncio.get_running_loop()
    lost: asyncio.Future[None] = loop.create_future()

    class Losing(asyncio.Protocol):
        def connection_lost(self, exc: Exception | None) -> None:
            lost.set_result(None)

    transport, _ = await loop.create_connection(Losing, sock=near)
    sender = PackageSender(ClientProtocol())
    sender.open(transport)
    shown: list[tuple[bytes, bool]] = []
    sender.tap = lambda data, sent, _own: shown.append((data, sent))
    assert sender.write(GetControllerVersion()) == 0
    sender.received(b"answer")
    closing = asyncio.create_task(sender.close(lost))
    assert await loop.sock_recv(far, 100) == b"\x00\x03v"
    assert await loop.sock_recv(far, 100) == b""
    far.close()
    await closing
    assert transport.is_closing()
    assert shown == [(b"\x00\x03v", True), (b"answer", False)]
    await sender.close(lost)


async def test_a_sender_without_a_transport_has_nothing_to_close() -> None:
    sender = PackageSender(ClientProtocol())
    sender.abort()
    await sender.close(asyncio.get_running_loop().create_future())
