"""Waiting for what a link brings about."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest


async def _until(condition: Callable[[], object], seconds: float = 10.0) -> None:
    async with asyncio.timeout(seconds):
        while not condition():  # noqa: ASYNC110 - what is waited for raises no event
            await asyncio.sleep(0.002)


@pytest.fixture
def until() -> Callable[..., Awaitable[None]]:
    """Wait until a condition holds, ten seconds at most."""
    return _until
