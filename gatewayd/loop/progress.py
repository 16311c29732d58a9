"""Long waits taken in short steps, so that a part that waits does not look like one that hangs."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TypeVar

from gatewayd.loop import clock

STEP = 0.25
"""Seconds between two signs of progress of a part, whatever it waits for."""
GRACE = 1.0
"""Seconds beyond its own limit after which a wait is no wait any more."""

_Result = TypeVar("_Result")


async def wait_with_progress(work: Awaitable[_Result], progress: Callable[[], None], limit: float) -> _Result:
    """The result of `work`, which ends by itself within `limit` seconds.

    `progress` is called every STEP seconds meanwhile, but no more once the work has outlasted its limit by GRACE
    seconds: it hangs. Raises what the work raises. A cancellation ends the work first.
    """
    task = asyncio.ensure_future(work)
    end = clock.now() + limit + GRACE
    try:
        while not task.done():
            if clock.now() < end:
                progress()
            await asyncio.wait((task,), timeout=STEP)
    except asyncio.CancelledError:
        task.cancel()
        await asyncio.wait((task,))
        if not task.cancelled():
            task.exception()  # else asyncio complains that nobody asked for it
        raise
    return task.result()
