"""Turns of those who must not hold up the loop: bounded in time and number, and none at another's expense."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Generator

import pytest

from gatewayd.loop import share as module
from gatewayd.loop.share import OVERHEAD, PIECE, SHARE, Busy, LoopShare, in_one_step


class Timer:
    """A clock that only work moves, and pauses as the loop is asked for them."""

    def __init__(self) -> None:
        self.time = 0.0
        self.pauses: list[float] = []

    def __call__(self) -> float:
        return self.time


@pytest.fixture
def timer() -> Timer:
    return Timer()


@pytest.fixture
async def share(timer: Timer, monkeypatch: pytest.MonkeyPatch) -> LoopShare:
    loop = asyncio.get_running_loop()

    def call_later(delay: float, begin: Callable[[], None]) -> asyncio.Handle:
        timer.pauses.append(delay)
        timer.time += delay
        return loop.call_soon(begin)

    monkeypatch.setattr(loop, "call_later", call_later)
    return LoopShare(timer)


def steps(timer: Timer, count: int, seconds: float) -> Generator[None, None, int]:
    for _ in range(count):
        timer.time += seconds
        yield
    return count


async def test_a_long_work_is_done_in_pieces_and_takes_no_more_than_its_share(
    share: LoopShare, timer: Timer
) -> None:
    assert await share.done("a", steps(timer, 1000, PIECE / 4)) == 1000
    worked = 1000 * PIECE / 4
    assert worked / timer.time == pytest.approx(SHARE, rel=0.1)
    assert max(timer.pauses) <= 2 * PIECE / SHARE


async def test_who_asks_now_and_then_waits_for_nothing(share: LoopShare, timer: Timer) -> None:
    for _ in range(5):
        await share.request("a")
        await share.done("a", steps(timer, 1, PIECE / 2))
    assert timer.pauses == []


async def test_no_two_pieces_are_done_in_one_turn_of_the_loop(share: LoopShare) -> None:
    loop, turns, done = asyncio.get_running_loop(), [0], list[int]()

    def count() -> None:
        turns[0] += 1
        loop.call_soon(count)

    loop.call_soon(count)
    await asyncio.gather(*(share.done("a", in_one_step(lambda: done.append(turns[0]))) for _ in range(10)))
    assert len(set(done)) == 10


async def test_every_request_costs_something(share: LoopShare, timer: Timer) -> None:
    for _ in range(1000):
        await share.request("a")
    assert timer.time == pytest.approx(1000 * OVERHEAD / SHARE, rel=0.2)


async def test_askers_have_turns_by_turns_however_much_each_wants(share: LoopShare, timer: Timer) -> None:
    order: list[str] = []

    async def ask(asker: str) -> None:
        def work() -> Generator[None, None, None]:
            order.append(asker)
            timer.time += PIECE
            yield from ()

        await share.done(asker, work())

    greedy = [ask("greedy") for _ in range(50)]
    async with asyncio.TaskGroup() as group:
        for work in (*greedy, ask("modest"), ask("other")):
            group.create_task(work)
    assert {"modest", "other"} <= set(order[:5])


async def test_the_same_is_done_once_for_all_who_asked_before_it_began(
    share: LoopShare, timer: Timer
) -> None:
    made: list[int] = []

    def begin() -> Generator[None, None, int]:
        made.append(len(made))
        timer.time += PIECE
        yield
        return made[-1]

    share._left = -1.0
    answers = await asyncio.gather(*(share.done_once("list", str(n), begin) for n in range(30)))
    assert answers == [0] * 30
    assert await share.done_once("list", "late", begin) == 1, "nobody gets what was true before he asked"


async def test_an_error_reaches_all_of_them_and_ends_there(share: LoopShare) -> None:
    def fail() -> None:
        raise ValueError("no such cell")

    share._left = -1.0
    found = await asyncio.gather(
        *(share.done_once("x", "a", lambda: in_one_step(fail)) for _ in range(3)), return_exceptions=True
    )
    assert [str(error) for error in found] == ["no such cell"] * 3
    assert await share.done_once("x", "a", lambda: in_one_step(lambda: 7)) == 7


async def test_what_waits_is_bounded(share: LoopShare, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "WAITING", 3)
    share._left = -1.0
    found = await asyncio.gather(*(share.request("a") for _ in range(5)), return_exceptions=True)
    assert [type(error) for error in found] == [type(None)] * 3 + [Busy] * 2
    await share.request("a")


async def test_who_goes_while_waiting_takes_no_turn_from_others(share: LoopShare) -> None:
    share._left = -1.0
    first, second, third = (asyncio.create_task(share.request(name)) for name in "abc")
    await asyncio.sleep(0)
    second.cancel()
    await asyncio.wait((first, second, third))
    assert (first.cancelled(), second.cancelled(), third.cancelled()) == (False, True, False)
    await share.request("a")
