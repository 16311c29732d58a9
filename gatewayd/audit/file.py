"""The audit's file: JSON lines, rotated by size, written by a thread of its own so that no disk ever stops the gateway.

A full disk, one that hangs, a directory without permission, a file that somebody moved away: the gateway serves on.
The trouble is reported once, lines wait in a bounded queue, writing is tried again, and the file counts what had to be
dropped meanwhile.
"""

from __future__ import annotations

import errno
import json
import logging
import os
import stat
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from gatewayd.logs.records import fields
from gatewayd.loop.lines import LineThread
from gatewayd.loop.retry import Failure, reason_of

MAX_SIZE = 16 * 1024 * 1024
"""Bytes after which the file becomes FILE.1, FILE.1 becomes FILE.2 and so on."""
KEPT = 5
"""Former files that are kept."""
QUEUE = 20_000
"""Lines that may wait for the disk."""
RETRY = 5.0
"""Seconds between two attempts after the file could not be written."""
HANGS = 5.0
"""Seconds after which a disk that is still busy with one write hangs."""
_GATHER = 0.2
"""Seconds for which lines are gathered before they are written together."""
_MODE = 0o640

log = logging.getLogger("gatewayd.audit")


class AuditFile(LineThread):
    """Appends lines to `path`. `put` never blocks and never raises; everything else happens in the thread."""

    def __init__(self, path: Path, limit: int = MAX_SIZE, kept: int = KEPT, retry: float = RETRY) -> None:
        super().__init__("audit file", QUEUE, self._append_lines, gather=_GATHER, retry=retry)
        self.path = path
        self._failure = Failure(self._report)
        self._limit = limit
        self._kept = kept
        self._counted = 0
        """Dropped lines that the file counts already."""
        self._descriptor = -1
        self._size = 0
        self._reported_hanging = False
        # A directory that is missing is reported at the start, not at the first write of the week.
        self.start()

    def trouble(self, now: float) -> str:
        """Why the file cannot be written now, or what of it is missing; empty while all is well."""
        if self._failure.reason:
            return self._failure.reason
        if self.held_up(now) > HANGS:
            return f"it has taken nothing for more than {HANGS:g} s"
        return "records are lost, they come faster than it takes them" if self.dropped > self._counted else ""

    def look(self, now: float) -> None:
        """Report a disk that hangs, once; its thread cannot."""
        if self.held_up(now) <= HANGS:
            self._reported_hanging = False
        elif not self._reported_hanging:
            self._reported_hanging = True
            log.error(
                "cannot write the audit file, serving on",
                extra=fields(file=str(self.path), reason=self.trouble(now)),
            )

    # -- the thread ----------------------------------------------------------------------------------------------

    def _append_lines(self, lines: Sequence[str]) -> bool:
        """Write these lines and how many are missing before them; whether that went well."""
        pending = self.dropped - self._counted
        if pending:
            lines = [*lines, json.dumps({"what": "records dropped", "times": pending})]
        data = "".join(line + "\n" for line in lines).encode()
        if not data and (self._descriptor >= 0 or self.closing):
            return True
        try:
            self._open()
            self._append(data)
        except OSError as error:
            self._let_go()
            self._failure.failed(error)
            return False
        self._counted += pending
        if self._failure.worked():
            log.info(
                "the audit file can be written again", extra=fields(file=str(self.path), dropped=pending)
            )
        return True

    def _open(self) -> None:
        """Have the file that has the name now: a moved or deleted one is begun anew, a full one is rotated."""
        if self._descriptor >= 0:
            with suppress(FileNotFoundError):
                if os.stat(self.path).st_ino != os.fstat(self._descriptor).st_ino:  # noqa: PTH116
                    self._let_go()
            if self._descriptor >= 0 and not self.path.exists():
                self._let_go()
        if self._descriptor >= 0 and self._size >= self._limit:
            self._let_go()
            self._rotate()
        if self._descriptor < 0:
            with suppress(FileNotFoundError):
                if stat.S_ISFIFO(self.path.stat().st_mode):
                    raise OSError(errno.EINVAL, "it is a pipe, which keeps nothing: name a file")
            # Should it become a pipe just now, nobody waits for its reader.
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK
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

    def _report(self, error: Exception) -> None:
        log.error(
            "cannot write the audit file, serving on",
            extra=fields(file=str(self.path), reason=reason_of(error)),
        )
