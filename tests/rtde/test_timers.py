"""The clocks of a connection, on a real loop with short times."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable

from gatewayd.rtde.timers import Deadline, ProbeTimer, RetryTimer

Until = Callable[..., Awaitable[None]]


async def test_a_deadline_is_replaced_by_the_next_and_can_be_cancelled(until: Until) -> None:
    passed: list[int] = []
    deadline = Deadline(lambda: passed.append(1))
    deadline.set(0.001)
    deadline.set(0.01)
    await until(lambda: passed)
    deadline.set(0.001)
    deadline.cancel()
    deadline.cancel()
    await asyncio.sleep(0.01)
    assert passed == [1]


async def test_a_probe_ends_once_with_its_answer_or_without(until: Until) -> None:
    ended: list[float] = []
    probe = ProbeTimer(0.02, ended.append)
    probe.answered()
    assert not ended, "nobody asked"
    probe.start()
    before = probe.running
    probe.answered()
    probe.answered()
    assert 0 <= ended[0] < 0.02
    assert (before, probe.running) == (True, False)
    probe.start()
    await until(lambda: len(ended) == 2)
    assert ended[1] == math.inf
    probe.start()
    probe.cancel()
    await asyncio.sleep(0.03)
    assert len(ended) == 2


async def test_retries_come_later_and_later_and_one_at_a_time(until: Until) -> None:
    calls: list[float] = []
    loop = asyncio.get_running_loop()
    retry = RetryTimer(0.03, lambda: calls.append(loop.time()))
    begun = loop.time()
    for number in range(3):
        retry.schedule()
        retry.schedule()
        await until(lambda: len(calls) == number + 1)  # noqa: B023
    assert 0.05 < calls[-1] - begun < 1, "never more than the longest, though the first wait is 0.1 s"
    retry.schedule()
    retry.cancel()
    await asyncio.sleep(0.05)
    assert len(calls) == 3
