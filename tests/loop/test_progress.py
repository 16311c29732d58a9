"""A wait is taken in turns, ends as its work ends, and takes its work along when it is cancelled."""

from __future__ import annotations

import asyncio
import gc
from contextlib import suppress

import pytest

from gatewayd.loop import progress as module
from gatewayd.loop.progress import wait_with_progress


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "STEP", 0.01)
    monkeypatch.setattr(module, "GRACE", 0.1)


class Counter:
    def __init__(self) -> None:
        self.count = 0

    def __call__(self) -> None:
        self.count += 1


async def test_the_result_comes_through_and_turns_are_counted_meanwhile() -> None:
    turns = Counter()
    assert await wait_with_progress(asyncio.sleep(0.1, "done"), turns, 0.1) == "done"
    assert 3 <= turns.count <= 11


async def test_what_is_done_at_once_has_had_a_turn() -> None:
    turns = Counter()
    await wait_with_progress(asyncio.sleep(0), turns, 0)
    assert turns.count == 1


async def test_an_error_comes_through() -> None:
    async def fail() -> None:
        raise OSError("refused")

    with pytest.raises(OSError, match="refused"):
        await wait_with_progress(fail(), Counter(), 1)


async def test_work_that_outlasts_its_limit_has_no_turns_any_more() -> None:
    turns = Counter()
    waiting = asyncio.create_task(wait_with_progress(asyncio.Event().wait(), turns, 0.05))
    await asyncio.sleep(0.3)
    seen = turns.count
    await asyncio.sleep(0.1)
    assert turns.count == seen
    waiting.cancel()
    with suppress(asyncio.CancelledError):
        await waiting


async def test_a_cancellation_ends_the_work_first() -> None:
    ended = []

    async def work() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            await asyncio.sleep(0.02)
            ended.append("work")

    waiting = asyncio.create_task(wait_with_progress(work(), Counter(), 1))
    await asyncio.sleep(0.02)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    assert ended == ["work"]


async def test_an_error_that_comes_with_the_cancellation_is_nobodys(caplog: pytest.LogCaptureFixture) -> None:
    async def work() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            raise OSError("at the end")

    waiting = asyncio.create_task(wait_with_progress(work(), Counter(), 1))
    await asyncio.sleep(0.02)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    del waiting
    gc.collect()
    assert caplog.records == []
