"""What takes long holds up neither the loop nor its end, and nothing that it has opened stays open."""

from __future__ import annotations

import asyncio
import threading
import time
from contextlib import suppress

import pytest

from gatewayd.loop.threads import in_daemon_thread


async def test_the_result_comes_back_and_the_loop_goes_on_meanwhile() -> None:
    go = threading.Event()

    def work() -> str:
        go.wait(10)
        return threading.current_thread().name

    waiting = asyncio.create_task(in_daemon_thread(work, "slow"))
    for _ in range(3):
        await asyncio.sleep(0.01)
    assert not waiting.done()
    go.set()
    assert await waiting == "slow"


async def test_an_error_comes_back() -> None:
    def fail() -> None:
        raise OSError("no such adapter")

    with pytest.raises(OSError, match="no such adapter"):
        await in_daemon_thread(fail, "fails")


async def test_what_comes_too_late_is_given_back() -> None:
    go, given = threading.Event(), threading.Event()
    unwanted: list[str] = []

    def work() -> str:
        go.wait(10)
        return "an open port"

    def close(result: str) -> None:
        unwanted.append(result)
        given.set()

    waiting = asyncio.create_task(in_daemon_thread(work, "slow", close))
    await asyncio.sleep(0.01)
    waiting.cancel()
    with suppress(asyncio.CancelledError):
        await waiting
    go.set()
    async with asyncio.timeout(10):
        while not given.is_set():  # noqa: ASYNC110 - a thread sets it
            await asyncio.sleep(0.01)
    assert unwanted == ["an open port"]


async def test_an_error_that_comes_too_late_is_nobodys() -> None:
    go = threading.Event()

    def work() -> None:
        go.wait(10)
        raise OSError("too late")

    waiting = asyncio.create_task(in_daemon_thread(work, "slow"))
    await asyncio.sleep(0.01)
    waiting.cancel()
    with suppress(asyncio.CancelledError):
        await waiting
    go.set()
    await asyncio.sleep(0.05)


def test_the_end_of_the_loop_waits_for_nobody() -> None:
    go, given = threading.Event(), threading.Event()

    async def main() -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(0.05):
                await in_daemon_thread(lambda: go.wait(10), "hangs", lambda _result: given.set())

    begin = time.monotonic()
    asyncio.run(main())
    assert time.monotonic() - begin < 5
    go.set()
    assert given.wait(10)
