from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Iterator
from functools import partial

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


async def test_nobody_is_kept_waiting_by_one_that_always_has_more() -> None:
    """A preferred one is served at once, another one by turns, and the loop goes on with its work."""
    pairs = [socket.socketpair() for _ in range(4)]
    poller = ReadPoller()
    served: list[int] = []

    def greedy(index: int) -> bool:
        begin = time.monotonic()
        while time.monotonic() - begin < 0.0003:  # longer than a turn is meant to be
            pass
        served.append(index)
        return True

    def modest(index: int) -> None:
        pairs[index][0].recv(10)
        served.append(index)

    poller.add(pairs[0][0].fileno(), partial(greedy, 0), again=True)
    poller.add(pairs[1][0].fileno(), partial(greedy, 1), again=True)
    poller.add(pairs[2][0].fileno(), partial(modest, 2))
    poller.add(pairs[3][0].fileno(), partial(modest, 3), preferred=True)
    turns = 0
    while len(served) < 20:
        await asyncio.sleep(0)
        turns += 1
    assert served[:4] == [0, 1, 0, 1]
    assert turns >= 20, "one in each turn of the loop"
    for index in (2, 3):
        pairs[index][1].send(b"a")
    before = len(served)
    for _ in range(10):
        await asyncio.sleep(0)
    assert 3 in served[before : before + 2], "before any of the others"
    assert 2 in served[before : before + 5], "after all that were there before"
    poller.remove(pairs[0][0].fileno())
    poller.close()
    for ends in pairs:
        for end in ends:
            end.close()


async def test_who_is_preferred_can_change(pair: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = pair
    poller = ReadPoller()
    received: list[bytes] = []
    poller.prefer(ours.fileno(), preferred=True)
    assert not poller._preferred, "not watched"
    poller.add(ours.fileno(), lambda: received.append(ours.recv(9)))
    poller.prefer(ours.fileno(), preferred=True)
    theirs.send(b"abc")
    await asyncio.sleep(0.01)
    assert received == [b"abc"]
    poller.remove(ours.fileno())
    assert not poller._preferred
    poller.close()
