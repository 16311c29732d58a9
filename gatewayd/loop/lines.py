"""Lines of text on their way to somewhere that may be slow, full or gone, which nobody else waits for."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Sequence

from gatewayd.loop import clock


class LineThread:
    """A bounded queue, emptied by a thread of its own. `put` never waits and never raises.

    `write` is called in the thread with all lines that wait, in the beginning also without any; False: they could not
    be written, and are tried again. `emptied` is called when nothing waits any more, and may put something.
    """

    def __init__(
        self,
        name: str,
        capacity: int,
        write: Callable[[Sequence[str]], bool],
        emptied: Callable[[], None] = lambda: None,
        *,
        gather: float = 0.0,
        retry: float = 0.0,
    ) -> None:
        """`gather`: seconds for which lines are collected; `retry`: seconds before a failed write is tried again."""
        self.dropped = 0
        """Lines that found no room since the start."""
        self._capacity = capacity
        self._write = write
        self._emptied = emptied
        self._gather = gather
        self._retry = retry
        self._waiting: deque[str] = deque()
        self._writing_since = math.inf
        self._wake = threading.Event()
        self._closing = threading.Event()
        # A daemon thread: one that waits for a reader or a disk for ever must not keep the process from its end.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    @property
    def closing(self) -> bool:
        """Whether there is no other attempt after this one."""
        return self._closing.is_set()

    def held_up(self, now: float) -> float:
        """Seconds for which the write under way takes already; 0 if there is none."""
        return max(0.0, now - self._writing_since)

    def put(self, line: str) -> None:
        """Queue a line; the oldest are kept, and this one is dropped, if the queue is full."""
        if len(self._waiting) >= self._capacity:
            self.dropped += 1
            return
        self._waiting.append(line)
        self._wake.set()

    def close(self, patience: float = 0.5) -> None:
        """Write what waits, for `patience` seconds at most."""
        self._closing.set()
        self._wake.set()
        self._thread.join(patience)

    # -- the thread ----------------------------------------------------------------------------------------------

    def _run(self) -> None:
        self._wake.set()
        while not self._closing.is_set():
            self._wake.wait()
            self._closing.wait(self._gather)
            self._wake.clear()
            if not self._empty() and not self._closing.wait(self._retry):
                self._wake.set()
        self._empty()

    def _empty(self) -> bool:
        """Hand over what waits; whether that went well."""
        waiting = self._waiting
        while True:
            lines = [waiting[position] for position in range(len(waiting))]  # others append meanwhile
            self._writing_since = clock.now()
            try:
                if not self._write(lines):
                    return False
            finally:
                self._writing_since = math.inf
            for _ in lines:
                waiting.popleft()
            if not waiting:
                self._emptied()
                if not waiting:
                    return True
