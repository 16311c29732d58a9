"""Waiting for what happens."""

from __future__ import annotations

import asyncio

from gatewayd.rtde.waiters import Waiters


async def test_all_who_wait_go_on_and_one_who_was_cancelled_leaves_nothing() -> None:
    waiters = Waiters()
    waiters.wake()
    assert not waiters.waiting
    tasks = [asyncio.create_task(waiters.wait()) for _ in range(3)]
    await asyncio.sleep(0)
    assert len(waiters.waiting) == 3
    tasks[0].cancel()
    await asyncio.wait(tasks[:1])
    waiters.wake()
    assert not waiters.waiting
    await asyncio.gather(*tasks[1:])
    alone = asyncio.create_task(waiters.wait())
    await asyncio.sleep(0)
    alone.cancel()
    await asyncio.wait((alone,))
    assert not waiters.waiting
