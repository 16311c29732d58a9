"""The receiving side of a connection, over a real socket pair: read by the loop, or directly."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable

import pytest

from gatewayd.rtde.receiving import PackageReceiver

Until = Callable[..., Awaitable[None]]


class Received(asyncio.BufferedProtocol):
    """Keeps what came, and by whom it was read."""

    def __init__(self) -> None:
        self.receiver = PackageReceiver(self.buffer_updated, self.interrupted)
        self.data: list[bytes] = []
        self.lost = False
        self.interrupts = 0
        self.error: BaseException | None = None

    def interrupted(self) -> None:
        self.interrupts += 1

    def get_buffer(self, sizehint: int) -> memoryview:
        return self.receiver.buffer

    def buffer_updated(self, nbytes: int) -> None:
        self.data.append(bytes(self.receiver.buffer[:nbytes]))
        if self.error is not None:
            raise self.error

    def connection_lost(self, exc: Exception | None) -> None:
        self.lost = True
        self.receiver.close()


Pair = tuple[Received, socket.socket]


@pytest.fixture
async def pair() -> AsyncIterator[Pair]:
    """A protocol, and the socket at the other end."""
    near, far = socket.socketpair()
    transport, protocol = await asyncio.get_running_loop().create_connection(Received, sock=near)
    protocol.receiver.open(transport)
    with far:
        yield protocol, far
    transport.abort()
    await asyncio.sleep(0)


def readable(receiver: PackageReceiver) -> bool:
    return receiver.wait(0) == receiver.readable


async def test_while_it_is_read_directly_the_loop_reads_nothing(pair: Pair, until: Until) -> None:
    protocol, far = pair
    receiver = protocol.receiver
    far.send(b"loop")
    await until(lambda: protocol.data == [b"loop"])
    assert not receiver.read(), "it is the loop that reads"
    receiver.expect(1.0)
    receiver.detach()
    assert receiver.read()
    await asyncio.sleep(0)
    assert not readable(receiver)
    far.send(b"direct")
    assert readable(receiver)
    await asyncio.sleep(0.01)
    assert protocol.data == [b"loop"]
    assert receiver.read()
    assert receiver.read(), "nothing there is no end"
    assert protocol.data == [b"loop", b"direct"]
    receiver.attach()
    far.send(b"loop again")
    await until(lambda: len(protocol.data) == 3)
    assert not receiver.direct


@pytest.mark.parametrize("rate, seconds", [(1e9, 0.02), (1.0, 0.1)])
async def test_what_is_left_unread_is_read_by_the_loop(
    pair: Pair, until: Until, rate: float, seconds: float
) -> None:
    protocol, far = pair
    protocol.receiver.expect(rate)
    protocol.receiver.detach()
    far.send(b"unread")
    begun = asyncio.get_running_loop().time()
    await until(lambda: protocol.data == [b"unread"])
    assert asyncio.get_running_loop().time() - begun > 1.5 * seconds
    assert not protocol.receiver.direct
    protocol.receiver.detach()
    protocol.receiver.attach()
    far.send(b"at once")
    await until(lambda: len(protocol.data) == 2)


async def test_an_end_is_left_to_the_loop(pair: Pair, until: Until) -> None:
    protocol, far = pair
    protocol.receiver.detach()
    await asyncio.sleep(0)
    far.close()
    assert not readable(protocol.receiver), "a hang-up is more than bytes"
    assert not protocol.receiver.read()
    protocol.receiver.attach()
    await until(lambda: protocol.lost)
    assert not protocol.receiver.read()
    protocol.receiver.detach()
    assert not protocol.receiver.direct


@pytest.mark.parametrize("error", [KeyboardInterrupt(), TimeoutError("of an alarm"), SystemExit()])
async def test_what_a_signal_handler_raises_is_passed_on_and_reported(
    pair: Pair, error: BaseException
) -> None:
    protocol, far = pair
    protocol.receiver.detach()
    protocol.error = error
    far.send(b"bytes")
    with pytest.raises(type(error)):
        protocol.receiver.read()
    assert protocol.interrupts == 1


async def test_an_error_of_the_socket_is_left_to_the_loop(until: Until) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        transport, protocol = await asyncio.get_running_loop().create_connection(
            Received, *server.getsockname()
        )
        peer = server.accept()[0]
    protocol.receiver.open(transport)
    protocol.receiver.detach()
    await asyncio.sleep(0)
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
    peer.close()
    assert not protocol.receiver.read()
    assert protocol.interrupts == 0
    protocol.receiver.attach()
    await until(lambda: protocol.lost)
