"""A bus handler that remembers what was reported to it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.errors import ErrorFrame
from gatewayd.canopen.frame import Frame


class Recorder:
    """Remembers everything, in the order in which it came."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.batches: list[int] = []
        self.errors: list[ErrorFrame] = []
        self.lost = 0
        self.states: list[BusState] = []
        self.reasons: list[str] = []
        self.writable = 0
        self.room: Callable[[], None] = lambda: None
        """What to do when there is room again."""

    def on_frames(self, frames: list[Frame], now: float) -> None:
        self.frames += frames
        self.batches.append(len(frames))

    def on_error(self, error: ErrorFrame, now: float) -> None:
        self.errors.append(error)

    def on_lost(self, count: int, now: float) -> None:
        self.lost += count

    def on_state(self, state: BusState, reason: str, now: float) -> None:
        self.states.append(state)
        self.reasons.append(reason)

    def on_writable(self, now: float) -> None:
        self.writable += 1
        self.room()


async def until(condition: Callable[[], object], seconds: float = 5.0) -> None:
    """Wait until the condition holds; TimeoutError if it does not in time."""
    async with asyncio.timeout(seconds):
        while not condition():  # noqa: ASYNC110 - what is waited for has no event
            await asyncio.sleep(0.002)
