from __future__ import annotations

import asyncio
import socket
from collections.abc import Iterator

import pytest

from gatewayd.links.modbus_server.polling import ReadPoller


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    ends = socket.socketpair()
    yield ends
    for end in ends:
        end.close()


async def test_calls_for_what_can_be_read_until_it_was_read(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    ours, theirs = pair
    poller = ReadPoller()
    received = bytearray()

    def read() -> None:
        received.extend(ours.recv(2))

    poller.add(ours.fileno(), read)
    theirs.send(b"abcde")
    await asyncio.sleep(0.01)
    assert received == b"abcde"
    poller.close()


async def test_calls_no_more_after_removal(pair: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = pair
    poller = ReadPoller()
    calls: list[int] = []
    poller.add(ours.fileno(), lambda: calls.append(1))
    poller.remove(ours.fileno())
    poller.remove(ours.fileno())
    theirs.send(b"a")
    await asyncio.sleep(0.01)
    assert not calls
    poller.close()
    poller.close()


async def test_a_reader_may_remove_another_one_of_the_same_turn() -> None:
    pairs = [socket.socketpair() for _ in range(2)]
    poller = ReadPoller()
    calls: list[int] = []

    def read() -> None:
        calls.append(1)
        for ours, _theirs in pairs:
            poller.remove(ours.fileno())

    for ours, theirs in pairs:
        theirs.send(b"a")
        poller.add(ours.fileno(), read)
    await asyncio.sleep(0.01)
    assert len(calls) == 1
    poller.close()
    for ends in pairs:
        for end in ends:
            end.close()
