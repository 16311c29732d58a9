"""Where the log goes, by a thread of its own: whoever reads it may stop reading, and the robot does not wait for that.

A pipe that is full makes its writer wait. Lines wait in a bounded queue instead; what does not fit is dropped, counted,
and told as soon as there is room.
"""

from __future__ import annotations

import logging
import os
import threading
from contextlib import suppress
from queue import Full, Queue

from gatewayd.logs.records import fields

__all__ = ["CAPACITY", "LogStream"]

CAPACITY = 10_000
"""Lines that may wait for the reader."""

log = logging.getLogger("gatewayd.logs")


class LogStream:
    """A stream for `gatewayd.logs.records.configure` on a file descriptor. Writing never waits and never raises."""

    def __init__(self, descriptor: int, capacity: int = CAPACITY) -> None:
        self.lost = 0
        """Lines dropped since the start."""
        self._told = 0
        self._descriptor = descriptor
        self._lines: Queue[str] = Queue(capacity)
        self._closing = threading.Event()
        # A daemon thread: one that waits for a reader for ever must not keep the process from its end.
        self._thread = threading.Thread(target=self._run, name="log", daemon=True)
        self._thread.start()

    def write(self, text: str) -> None:
        """Queue a line with its end; the oldest are kept, and this one is dropped, if the queue is full."""
        try:
            self._lines.put_nowait(text)
        except Full:
            self.lost += 1

    def flush(self) -> None:
        """Nothing: lines are on their way."""

    def fileno(self) -> int:
        """The descriptor that is written to."""
        return self._descriptor

    def close(self, patience: float = 0.5) -> None:
        """Write what waits, for `patience` seconds at most."""
        self._closing.set()
        with suppress(Full):  # then the thread has something to wake it
            self._lines.put_nowait("")
        self._thread.join(patience)

    # -- the thread ----------------------------------------------------------------------------------------------

    def _run(self) -> None:
        while not (self._closing.is_set() and self._lines.empty()):
            self._put(self._lines.get())
            untold = self.lost - self._told
            if untold and self._lines.empty():  # there is room to tell it
                self._told += untold
                log.warning("log lines lost", extra=fields(lines=untold))

    def _put(self, text: str) -> None:
        rest = memoryview(text.encode("utf-8", "backslashreplace"))
        try:
            # Not through sys.stderr: a thread that waits inside it would hold a lock that the interpreter's end needs.
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            return
