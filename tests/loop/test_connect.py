from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from gatewayd.loop import connect as connecting
from gatewayd.loop.connect import DeadPeer, connect
from gatewayd.loop.resolve import SocketAddress

WATCHED = DeadPeer(idle=4, interval=2, probes=3, unacknowledged=1500)


class Peer(asyncio.Protocol):
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport


@pytest.fixture
def port() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield int(server.getsockname()[1])


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


def addresses(monkeypatch: pytest.MonkeyPatch, *found: tuple[str, int]) -> None:
    async def resolve(_host: str, _port: int) -> list[SocketAddress]:
        return [(socket.AF_INET, socket.SOCK_STREAM, 0, address) for address in found]

    monkeypatch.setattr(connecting, "resolve", resolve)


def sockets() -> int:
    return sum(
        path.is_symlink() and str(path.readlink()).startswith("socket:")
        for path in Path("/proc/self/fd").iterdir()
    )


async def test_addresses_are_tried_in_turn(port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    addresses(monkeypatch, ("127.0.0.1", free_port()), ("127.0.0.1", port))
    peer = await connect(Peer, "robot.example", 1)
    assert peer.transport.get_extra_info("peername") == ("127.0.0.1", port)
    peer.transport.close()


@pytest.mark.parametrize(
    "found, error", [((), socket.gaierror), ((("127.0.0.1", 0),), ConnectionRefusedError)]
)
async def test_what_the_last_address_said_is_raised_and_nothing_stays_open(
    found: tuple[tuple[str, int], ...], error: type[OSError], monkeypatch: pytest.MonkeyPatch
) -> None:
    addresses(monkeypatch, *((host, free_port()) for host, _ in found))
    before = sockets()
    with pytest.raises(error):
        await connect(Peer, "robot.example", 1)
    assert sockets() == before


async def test_a_family_that_this_machine_does_not_have_is_passed_over(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def resolve(_host: str, _port: int) -> list[tuple[int, int, int, tuple[str, int]]]:
        return [
            (250, socket.SOCK_STREAM, 0, ("::1", 1)),
            (socket.AF_INET, socket.SOCK_STREAM, 0, ("127.0.0.1", port)),
        ]

    monkeypatch.setattr(connecting, "resolve", resolve)
    peer = await connect(Peer, "robot.example", 1)
    peer.transport.close()


@pytest.mark.parametrize("dead_peer", [None, WATCHED])
async def test_the_kernel_watches_the_peer_where_that_is_wanted(
    port: int, dead_peer: DeadPeer | None
) -> None:
    peer = await connect(Peer, "127.0.0.1", port, dead_peer)
    own = peer.transport.get_extra_info("socket")
    assert own.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
    assert bool(own.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)) is (dead_peer is not None)
    if dead_peer is not None:
        options = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT, socket.TCP_USER_TIMEOUT)
        assert [own.getsockopt(socket.IPPROTO_TCP, option) for option in options] == [4, 2, 3, 1500]
    peer.transport.close()
