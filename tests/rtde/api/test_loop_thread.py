"""A loop in a thread, and turns of it that another thread takes."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator

import pytest

from gatewayd.rtde.api.errors import RtdeError
from gatewayd.rtde.api.loop_thread import LoopThread

PATIENCE = 10.0


@pytest.fixture
def thread() -> Iterator[LoopThread]:
    """One that is closed at the end."""
    one = LoopThread("test")
    yield one
    one.close()


async def _nothing() -> int:
    return 1


def test_work_is_done_in_the_thread_and_its_errors_are_raised_here(thread: LoopThread) -> None:
    async def who() -> int:
        return threading.get_ident()

    async def fail() -> None:
        raise ValueError

    assert thread.run(who()) not in {threading.get_ident(), 0}
    with pytest.raises(ValueError):
        thread.run(fail())


def test_no_callback_runs_in_somebody_elses_turn(thread: LoopThread) -> None:
    ran = threading.Event()
    with thread.loop.turn:
        thread.loop.call_soon_threadsafe(ran.set)
        assert not ran.wait(0.02)
    assert ran.wait(PATIENCE)


def test_whoever_has_the_turn_may_act_as_a_callback(thread: LoopThread) -> None:
    called = threading.Event()
    loop = thread.loop
    with loop.turn:
        loop.call_soon(called.set)
    assert called.wait(PATIENCE)
    called.clear()
    with loop.turn:
        begun = time.monotonic()
        loop.call_later(0.03, called.set)
    assert called.wait(PATIENCE)
    assert time.monotonic() - begun < 5

    async def future() -> asyncio.Future[int]:
        return asyncio.get_running_loop().create_future()

    async def value(awaited: asyncio.Future[int]) -> int:
        return await awaited

    promised = thread.run(future())
    awaiting = asyncio.run_coroutine_threadsafe(value(promised), loop)
    with loop.turn:
        promised.set_result(7)
    assert awaiting.result(PATIENCE) == 7


def test_a_closed_loop_and_its_own_thread_are_refused() -> None:
    thread = LoopThread("test")

    async def nested() -> str:
        with pytest.raises(RtdeError, match="wait for itself") as refused:
            thread.run(_nothing())
        return str(refused.value)

    assert thread.run(nested())
    thread.close()
    thread.close()
    with pytest.raises(RtdeError, match="closed"):
        thread.run(_nothing())
