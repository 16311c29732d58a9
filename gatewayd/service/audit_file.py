"""The audit's file: JSON lines, rotated by size, written by a thread of its own so that no disk ever stops the gateway.

A full disk, a directory without permission, a file that somebody moved away: the gateway serves on. The trouble is
told once, lines wait in a bounded queue, writing is tried again, and the file counts what had to be dropped meanwhile.
"""

from __future__ import annotations

import json
import logging
import os
import threading
from collections import deque
from contextlib import suppress
from pathlib import Path

from gatewayd.logs.records import fields

__all__ = ["GREATEST_SIZE", "KEPT", "QUEUE", "RETRY", "AuditFile"]

GREATEST_SIZE = 16 * 1024 * 1024
"""Bytes after which the file becomes FILE.1, FILE.1 becomes FILE.2 and so on."""
KEPT = 5
"""Former files that are kept."""
QUEUE = 20_000
"""Lines that may wait for the disk."""
RETRY = 5.0
"""Seconds between two attempts after the file could not be written."""
_GATHER = 0.2
"""Seconds for which lines are gathered before they are written together."""
_MODE = 0o640

log = logging.getLogger("gatewayd.audit")


class AuditFile:
    """Appends lines to `path`. `write` never blocks and never raises; everything else happens in the thread."""

    def __init__(
        self, path: Path, greatest: int = GREATEST_SIZE, kept: int = KEPT, retry: float = RETRY
    ) -> None:
        self.path = path
        self.dropped = 0
        """Lines lost since the start."""
        self.trouble = ""
        """Why the file cannot be written now; empty while it can."""
        self._greatest = greatest
        self._kept = kept
        self._retry = retry
        self._waiting: deque[str] = deque()
        self._told = 0
        """Dropped lines that the file counts already."""
        self._wake = threading.Event()
        self._closing = threading.Event()
        self._descriptor = -1
        self._size = 0
        self._thread = threading.Thread(target=self._run, name="audit file", daemon=True)
        self._thread.start()

    def write(self, line: str) -> None:
        """Queue one line; the oldest ones are kept and this one is dropped if the queue is full."""
        if len(self._waiting) >= QUEUE:
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
        # A directory that is missing is told at the start, not at the first write of the week.
        self._wake.set()
        while not self._closing.is_set():
            self._wake.wait()
            self._closing.wait(_GATHER)
            self._wake.clear()
            if not self._flush() and not self._closing.wait(self._retry):
                self._wake.set()
        self._flush()
        self._let_go()

    def _flush(self) -> bool:
        """Write all that waits; whether that went well."""
        waiting, untold = self._waiting, self.dropped - self._told
        lines = [waiting[position] for position in range(len(waiting))]
        if untold:
            lines.append(json.dumps({"what": "records dropped", "times": untold}))
        data = "".join(line + "\n" for line in lines).encode()
        if not data and (self._descriptor >= 0 or self._closing.is_set()):
            return True
        try:
            self._open()
            self._append(data)
        except OSError as error:
            self._let_go()
            self._complain(error.strerror or str(error))
            return False
        for _ in range(len(lines) - bool(untold)):
            waiting.popleft()
        self._told += untold
        if self.trouble:
            self.trouble = ""
            log.info("the audit file can be written again", extra=fields(file=str(self.path), dropped=untold))
        return True

    def _open(self) -> None:
        """Have the file that has the name now: a moved or deleted one is begun anew, a full one is rotated."""
        if self._descriptor >= 0:
            with suppress(FileNotFoundError):
                if os.stat(self.path).st_ino != os.fstat(self._descriptor).st_ino:  # noqa: PTH116
                    self._let_go()
            if self._descriptor >= 0 and not self.path.exists():
                self._let_go()
        if self._descriptor >= 0 and self._size >= self._greatest:
            self._let_go()
            self._rotate()
        if self._descriptor < 0:
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC
            self._descriptor = os.open(self.path, flags, _MODE)
            self._size = os.fstat(self._descriptor).st_size

    def _rotate(self) -> None:
        for number in range(self._kept, 0, -1):
            former = self.path.with_name(f"{self.path.name}.{number - 1}") if number > 1 else self.path
            with suppress(FileNotFoundError):
                former.replace(self.path.with_name(f"{self.path.name}.{number}"))

    def _append(self, data: bytes) -> None:
        """All or nothing, as far as the disk allows: a part that was written before the disk was full is taken back."""
        begun = self._size
        rest = memoryview(data)
        try:
            while rest:
                written = os.write(self._descriptor, rest)
                self._size += written
                rest = rest[written:]
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._descriptor, begun)
            raise

    def _let_go(self) -> None:
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            with suppress(OSError):
                os.close(descriptor)

    def _complain(self, reason: str) -> None:
        if reason != self.trouble:
            self.trouble = reason
            log.error(
                "cannot write the audit file, serving on", extra=fields(file=str(self.path), reason=reason)
            )
