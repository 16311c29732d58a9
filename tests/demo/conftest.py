"""A demonstration that runs, on a free port."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable

import pytest

from gatewayd.demo.scene import Scene

Until = Callable[[Callable[[], bool]], object]

PATIENCE = 20.0


@pytest.fixture
async def scene() -> AsyncIterator[Scene]:
    played = Scene(0)
    async with played.playing():
        yield played


@pytest.fixture
def until() -> Until:
    """Wait until something is so; the machine may be slow."""

    async def wait(condition: Callable[[], bool]) -> None:
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "it never came to be"
            await asyncio.sleep(0.02)

    return wait
