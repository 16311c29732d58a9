"""Bounded buffers between the connection and the program: what is lost is counted and reported, never silent."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Generic, Self, TypeVar

_Item = TypeVar("_Item")


class BoundedStream(Generic[_Item]):
    """An asynchronous iterator over everything that is put in, for one reader at a time.

    When `limit` items wait, each further one drives out the oldest; `overflow(lost, total)` is called at the first one
    and when reading goes on. Ends by StopAsyncIteration or, after what is left in it, by the error it was ended with.
    """

    __slots__ = (
        "_ended",
        "_error",
        "_items",
        "_limit",
        "_lost",
        "_overflow",
        "_read",
        "_waiter",
        "closing",
        "overflowed",
    )

    def __init__(self, limit: int, overflow: Callable[[int, int], None] = lambda _lost, _total: None) -> None:
        self.overflowed = 0
        """Items lost so far."""
        self.closing: Callable[[], None] = lambda: None
        """Called by `close`."""
        self._limit = limit
        self._overflow = overflow
        self._items: deque[_Item] = deque()
        self._lost = 0
        self._read = False
        self._ended = False
        self._error: Exception | None = None
        self._waiter: asyncio.Future[None] | None = None

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> _Item:
        if self._lost or not self._read:
            self._begin_reading()
        while not self._items:
            if self._ended:
                raise StopAsyncIteration if self._error is None else self._error
            if self._waiter is None or self._waiter.done():  # a reader that was cancelled has cancelled it
                self._waiter = asyncio.get_running_loop().create_future()
            # Awaited by itself: behind a shield, each item would take one more turn of the loop.
            await self._waiter
        return self._items.popleft()

    def __len__(self) -> int:
        return len(self._items)

    async def next(self, timeout: float | None = None) -> _Item:  # noqa: ASYNC109  a public API in seconds
        """The next item; TimeoutError after `timeout` seconds, StopAsyncIteration at the end."""
        async with asyncio.timeout(timeout):
            return await self.__anext__()

    def take(self) -> list[_Item]:
        """All that is there, without waiting."""
        if self._lost or not self._read:
            self._begin_reading()
        items = list(self._items)
        self._items.clear()
        return items

    def first(self) -> _Item | None:
        """The next item if it is there, without waiting; else None."""
        if self._lost or not self._read:
            self._begin_reading()
        return self._items.popleft() if self._items else None

    def put(self, item: _Item) -> None:
        """Add an item, at the cost of the oldest if the buffer is full."""
        items = self._items
        if len(items) >= self._limit:
            items.popleft()
            self.overflowed += 1
            self._lost += 1
            if self._lost == 1 and self._read:
                self._overflow(1, self.overflowed)
        items.append(item)
        if self._waiter is not None:
            self._wake()

    def end(self, error: Exception | None = None) -> None:
        """No more items come; waiting callers get `error`, or the end."""
        self._ended, self._error = True, error
        if self._waiter is not None:
            self._wake()

    def close(self) -> None:
        """Take nothing more in; what is there can still be read. May be called twice."""
        closing, self.closing = self.closing, lambda: None
        closing()
        self.end()

    def reopen(self) -> None:
        """Items come again."""
        self._ended, self._error = False, None

    def _begin_reading(self) -> None:
        lost, self._lost = self._lost, 0
        if lost > 1 or (lost and not self._read):
            self._overflow(lost, self.overflowed)
        self._read = True

    def _wake(self) -> None:
        waiter, self._waiter = self._waiter, None
        if waiter is not None and not waiter.done():
            waiter.set_result(None)
