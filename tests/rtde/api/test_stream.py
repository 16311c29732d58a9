"""Bounded streams: order, overflow, end."""

from __future__ import annotations

import asyncio

import pytest

from gatewayd.rtde.api.stream import BoundedStream


async def test_items_come_in_their_order_and_waiting_ends_with_the_stream() -> None:
    stream: BoundedStream[int] = BoundedStream(10)
    for item in range(3):
        stream.put(item)
    assert [await anext(stream) for _ in range(3)] == [0, 1, 2]
    waiting = asyncio.create_task(stream.next(5))
    await asyncio.sleep(0)
    stream.put(3)
    assert await waiting == 3
    stream.put(4)
    stream.end()
    assert [item async for item in stream] == [4]
    stream.reopen()
    stream.put(5)
    assert stream.first() == 5
    assert stream.first() is None
    assert stream.take() == []
    stream.end(OSError("gone"))
    with pytest.raises(OSError, match="gone"):
        await anext(stream)


async def test_an_overflow_drops_the_oldest_and_is_reported_at_both_ends() -> None:
    reports: list[tuple[int, int]] = []
    stream: BoundedStream[int] = BoundedStream(3, lambda lost, total: reports.append((lost, total)))
    for item in range(5):
        stream.put(item)
    assert reports == [], "nobody reads yet"
    assert stream.take() == [2, 3, 4]
    assert reports == [(2, 2)]
    for item in range(6):
        stream.put(item)
    assert reports[1:] == [(1, 3)]
    assert await anext(stream) == 3
    assert reports[2:] == [(3, 5)]
    assert stream.overflowed == 5


async def test_next_gives_up_in_time() -> None:
    with pytest.raises(TimeoutError):
        await BoundedStream[int](1).next(0.001)


async def test_a_reader_that_gave_up_reads_on() -> None:
    stream: BoundedStream[int] = BoundedStream(3)
    with pytest.raises(TimeoutError):
        await stream.next(0.001)
    asyncio.get_running_loop().call_soon(stream.put, 7)
    assert await stream.next(5) == 7
