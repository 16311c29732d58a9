"""One recording from its first attempt to connect to its end, however it ends."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable
from dataclasses import dataclass

from gatewayd.cli.rtde.progress import Tally
from gatewayd.cli.rtde.recorder import Recorder, RecordingOrder
from gatewayd.cli.rtde.sources import Arrivals, PackageSource, SourceLostError

TICK = 0.2
"""Seconds between two looks at whether it is to end."""
_RATE_PERIOD = 1.0
_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True, slots=True)
class RecordingEnd:
    """How a recording ended."""

    tally: Tally | None
    """What it has; None: it was never begun."""
    failure: str = ""
    """Why it ended before it was to; empty: it did not."""


class Rate:
    """Packages per second, measured in periods of a second."""

    def __init__(self, now: float) -> None:
        self.value = 0.0
        self._since = now
        self._count = 0

    def count(self, packages: int, now: float) -> float:
        """Take in what came until now; the rate of the last full period."""
        self._count += packages
        span = now - self._since
        if span >= _RATE_PERIOD:
            self.value, self._count, self._since = self._count / span, 0, now
        return self.value


async def recorded(
    source: PackageSource,
    order: RecordingOrder,
    show: Callable[[Tally], None],
    note: Callable[[str], None],
) -> RecordingEnd:
    """Record until the order is fulfilled, a signal comes, or the source ends.

    `show` gets the progress several times a second, `note` lines for people. RecordingError, ConditionError and
    SourceRefusedError are raised; what is recorded then is whole.
    """
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in _ENDING:
        loop.add_signal_handler(number, stop.set)
    try:
        return await _recorded(source, order, show, note, stop)
    finally:
        await source.close()
        for number in _ENDING:
            loop.remove_signal_handler(number)


async def _recorded(
    source: PackageSource,
    order: RecordingOrder,
    show: Callable[[Tally], None],
    note: Callable[[str], None],
    stop: asyncio.Event,
) -> RecordingEnd:
    loop = asyncio.get_running_loop()
    opening = asyncio.ensure_future(source.open())
    try:
        while not opening.done() and not stop.is_set():
            await asyncio.wait((opening,), timeout=TICK)
            show(Tally(waiting=source.waiting))
        if not opening.done():
            return RecordingEnd(None)
        layout = opening.result()
    except SourceLostError as error:
        return RecordingEnd(None, str(error))
    finally:
        opening.cancel()
    rate, waiting = Rate(loop.time()), ""
    with Recorder(order, layout) as recorder:
        try:
            while not recorder.over and not stop.is_set():
                arrivals = await source.next(TICK)
                waiting = _handled(arrivals, recorder, note, loop.time(), waiting)
                recorder.look(loop.time())
                shown = waiting or ("waiting for the condition" if recorder.waiting else "")
                show(recorder.tally(rate.count(len(arrivals.packages), loop.time()), shown))
        except SourceLostError as error:
            return RecordingEnd(recorder.tally(), str(error))
        return RecordingEnd(recorder.tally())


def _handled(
    arrivals: Arrivals, recorder: Recorder, note: Callable[[str], None], now: float, waiting: str
) -> str:
    """Record what came; what is being waited for from now on."""
    recorder.take(arrivals.packages, now)
    if arrivals.lost:
        recorder.lost(arrivals.lost)
    for line in arrivals.notes:
        note(line)
    return arrivals.waiting or ("" if arrivals.packages else waiting)
