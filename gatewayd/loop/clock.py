"""The clocks, and a loop that judges the time before it serves anything.

- `now`: the time of everything in the daemon, leases and ages included. CLOCK_MONOTONIC, which stands still while
  the machine is suspended, and all the time it was suspended for. Equal to `loop.time()` of a `ClockedLoop`.
- `raw`: CLOCK_MONOTONIC_RAW, for comparisons with another machine's clock: no time service adjusts its speed. It
  goes on in suspension too, as the other machine's does; packages from before would not look late otherwise.

- `judged_now`: the same as `now`, at the beginning of a callback: whether the process stood still is judged first.
- `overdue`: whether it stood still since, so that what the callback is about to hand out is old.

asyncio serves sockets before timers. After the process stood still (stopped, suspended, starved of the CPU) what
waited in the sockets would therefore be served before anything notices that time has passed. The selector is what
runs first in every turn, so it is here that most gaps are noticed, and their listeners hear of it before any socket or
timer. A process that was stopped in the middle of a turn still has callbacks of that turn before it: those that serve
sockets, or judge somebody for silence, begin with `judged_now`.

A machine whose clocks all stand still with it (some virtual machines when paused) shows no gap.
"""

from __future__ import annotations

import asyncio
import selectors
import time
from collections.abc import Callable
from dataclasses import dataclass

GAP = 0.05
"""Seconds beyond what the loop wanted to sleep after which the process counts as having stood still."""
_MOST_GAPS = 3
"""Gaps in a row, each while the one before it was judged: more of them are listeners that take that long."""
_NOTICEABLE = 0.01
"""Seconds between two readings of two clocks that are no suspension."""

_CLOCK_RAW = getattr(time, "CLOCK_MONOTONIC_RAW", time.CLOCK_MONOTONIC)
_CLOCK_BOOT = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)

_monotonic = time.monotonic
_read = time.clock_gettime


class _Suspension:
    """How long the machine was suspended since this module was imported; judged once in each turn of the loop."""

    def __init__(self) -> None:
        self.total = 0.0
        self._offset = _read(_CLOCK_BOOT) - _monotonic()

    def look(self) -> None:
        asleep = _read(_CLOCK_BOOT) - _monotonic() - self._offset
        if asleep - self.total > _NOTICEABLE:
            self.total = asleep


_suspension = _Suspension()


def now() -> float:
    """Seconds of the daemon's own clock; never goes back, goes on while the machine is suspended."""
    return _monotonic() + _suspension.total


def raw() -> float:
    """Seconds of CLOCK_MONOTONIC_RAW, which no time service corrects; goes on while the machine is suspended."""
    return _read(_CLOCK_RAW) + _suspension.total


@dataclass(frozen=True, slots=True)
class Gap:
    """A time in which the process did nothing, though it should have."""

    since: float
    """End of the last turn of the loop before it, by `now`."""
    until: float

    @property
    def length(self) -> float:
        """Seconds for which something that is read now may have waited."""
        return self.until - self.since


GapListener = Callable[[Gap], None]


class _Watch:
    """When the loop was last seen at work, and who is notified when it was not. Only the loop's thread may look."""

    def __init__(self) -> None:
        self.listeners: list[GapListener] = []
        self.seen = now()

    def look(self) -> float:
        """The time; if too much has passed since the last look, with the loop awake, the listeners are called first."""
        since, self.seen = self.seen, now()
        if self.seen - since > GAP:
            self.stood_still(since)
        return self.seen

    def stood_still(self, since: float) -> None:
        """Call the listeners; again if the process was stopped while they were called."""
        for _ in range(_MOST_GAPS):
            gap = Gap(since, self.seen)
            for listener in self.listeners:
                listener(gap)
            since, self.seen = self.seen, now()
            if self.seen - since <= GAP:
                break


_watch: _Watch | None = None
"""That of the process's loop; None where the loop is another one."""


def judged_now() -> float:
    """`now`, for callbacks that serve what may have waited; listeners of a gap are called before it returns.

    To be called first in a callback, before anything is changed: the listeners change cells and links.
    """
    return now() if _watch is None else _watch.look()


def overdue() -> bool:
    """Whether the process stands still since the time was judged last, as far as its loop can know.

    For the end of a callback, where nothing can be judged any more: what it hands out was made before the gap.
    """
    return _watch is not None and now() - _watch.seen > GAP


class _Selector(selectors.DefaultSelector):
    """Looks at the time when a turn of the loop begins, before what the turn will serve is known."""

    def __init__(self, watch: _Watch) -> None:
        super().__init__()
        self._watch = watch

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """See selectors.BaseSelector; the listeners of a gap are called first."""
        watch = self._watch
        asleep_at = watch.look()
        found: list[tuple[selectors.SelectorKey, int]] = super().select(timeout)
        _suspension.look()
        watch.seen = now()
        if timeout is not None and watch.seen - asleep_at - timeout > GAP:
            watch.stood_still(asleep_at)
            # A process that was stopped in epoll_wait gets EINTR from it when it goes on, and Python, whose time-out
            # has passed meanwhile, returns nothing although something waits. Timers would come first then, and take
            # those for silent whose bytes are there.
            found = super().select(0)
        return found


class ClockedLoop(asyncio.SelectorEventLoop):
    """An event loop on `now`, whose `gap_listeners` are called before anything else after a gap. They must not raise.

    There is one in a process.
    """

    def __init__(self) -> None:
        global _watch  # noqa: PLW0603 - the clock of the process, as its loop is
        watch = _watch = _Watch()
        self.gap_listeners = watch.listeners
        super().__init__(_Selector(watch))

    def time(self) -> float:
        """See asyncio; `now`, so that deadlines pass while the machine is suspended."""
        return now()

    def close(self) -> None:
        """See asyncio; nobody judges the time any more."""
        global _watch  # noqa: PLW0603 - as above
        _watch = None
        super().close()


def on_gap(listener: GapListener) -> None:
    """Have `listener` called after gaps of the running loop; another kind of loop notices none."""
    loop = asyncio.get_running_loop()
    if isinstance(loop, ClockedLoop):
        loop.gap_listeners.append(listener)
