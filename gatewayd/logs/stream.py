"""Where the log goes, by a thread of its own: its reader may stop reading, and the robot does not wait for that.

A pipe that is full makes its writer wait. Lines wait in a bounded queue instead; what does not fit is dropped, counted,
and reported as soon as there is room.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence

from gatewayd.logs.records import fields
from gatewayd.loop.lines import LineThread

CAPACITY = 10_000
"""Lines that may wait for the reader."""

HANGS = 5.0
"""Seconds after which a reader that takes nothing is a trouble."""

log = logging.getLogger("gatewayd.logs")


class LogStream(LineThread):
    """A stream for `gatewayd.logs.records.configure` on a file descriptor. Writing never waits and never raises."""

    def __init__(self, descriptor: int, capacity: int = CAPACITY) -> None:
        super().__init__("log", capacity, self._write_out, self._report_lost)
        self._reported = 0
        self._descriptor = descriptor
        self.start()

    def write(self, text: str) -> None:
        """Queue a line with its end."""
        self.put(text)

    def flush(self) -> None:
        """Nothing: lines are on their way."""

    def fileno(self) -> int:
        """The descriptor that is written to."""
        return self._descriptor

    # -- the thread ----------------------------------------------------------------------------------------------

    def _write_out(self, lines: Sequence[str]) -> bool:
        rest = memoryview("".join(lines).encode("utf-8", "backslashreplace"))
        try:
            # Not through sys.stderr: a thread that waits inside it would hold a lock that the interpreter's end needs.
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            return True  # to nobody
        return True

    def _report_lost(self) -> None:
        """There is room to report it."""
        pending = self.dropped - self._reported
        if pending:
            self._reported += pending
            log.warning("log lines lost", extra=fields(lines=pending))


def log_troubles(now: float) -> list[str]:
    """What is wrong with the log as it is configured now: it cannot say so itself."""
    streams = (getattr(handler, "stream", None) for handler in logging.getLogger().handlers)
    hangs = any(isinstance(stream, LogStream) and stream.held_up(now) > HANGS for stream in streams)
    return (
        [f"nobody has read the log for more than {HANGS:g} s: lines wait, and then are lost"] if hangs else []
    )
