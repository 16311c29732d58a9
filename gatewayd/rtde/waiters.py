"""Coroutines that wait until something has happened."""

from __future__ import annotations

import asyncio


class Waiters:
    """Those that wait for the same."""

    __slots__ = ("waiting",)

    def __init__(self) -> None:
        self.waiting: list[asyncio.Future[None]] = []
        """One for each of them."""

    async def wait(self) -> None:
        """Wait for the next `wake`."""
        future = asyncio.get_running_loop().create_future()
        self.waiting.append(future)
        try:
            await future
        finally:
            if future in self.waiting:
                self.waiting.remove(future)

    def wake(self) -> None:
        """Let all go on that wait now."""
        futures, self.waiting = self.waiting, []
        for future in futures:
            if not future.done():
                future.set_result(None)
