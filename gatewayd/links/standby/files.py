"""The two files by which keepalived, or anything else that moves the address, learns how a cell is.

`standby-CELL` holds `0` while this gateway may have the address and `1` while it must not: keepalived follows it
(`track_file`, weight 0) within milliseconds. A gateway that is killed cannot write it. So `standby-CELL.alive` is
locked as long as the process lives, and touched as long as it works: `gatewayd-standby-alive` looks at both.
"""

from __future__ import annotations

import fcntl
import logging
import os
from collections.abc import Mapping
from pathlib import Path

from gatewayd.logs.records import fields
from gatewayd.loop.retry import Failure, reason_of

TOUCH_PERIOD = 0.25
"""Seconds between two touches."""
RETRY_PERIOD = 2.0
"""Seconds after which files that cannot be had are tried again."""
_MODE = 0o644

log = logging.getLogger("gatewayd.standby")


def directory_of(environment: Mapping[str, str], state: Path) -> Path:
    """Where the files are: what systemd gives (RUNTIME_DIRECTORY), else the directory of the state."""
    given = environment.get("RUNTIME_DIRECTORY")
    return Path(given.partition(":")[0]) if given else state


class StandbyFiles:
    """The files of one cell. Trouble with them is logged once, and tried again."""

    def __init__(self, directory: Path, cell: str) -> None:
        self.path = directory / f"standby-{cell}"
        """The one to follow."""
        self.alive = directory / f"standby-{cell}.alive"
        self._failure = Failure(self._report)
        self._written: bool | None = None
        self._lock: int | None = None
        self._touched = -TOUCH_PERIOD
        self._failed = -RETRY_PERIOD

    def update(self, now: float, *, eligible: bool) -> None:
        """Have them say whether this gateway may have the address, and that it lives."""
        if self.trouble and now - self._failed < RETRY_PERIOD:
            return
        try:
            self._update(now, eligible=eligible)
        except OSError as error:
            self._failed = now
            self._failure.failed(error)
        else:
            self._failure.worked()

    @property
    def trouble(self) -> str:
        """Why they cannot be written now; empty: they can."""
        return self._failure.reason

    def close(self) -> None:
        """Have them say that this gateway must not have the address any more."""
        self.update(self._failed + RETRY_PERIOD, eligible=False)
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _report(self, error: Exception) -> None:
        log.error(
            "the file for the virtual address cannot be written",
            extra=fields(file=str(self.path), reason=reason_of(error), retry_s=RETRY_PERIOD),
        )

    def _update(self, now: float, *, eligible: bool) -> None:
        if self._lock is None:
            self._open()
        if eligible is not self._written:
            # In place, not by renaming: who follows the file may follow what is behind its name.
            self.path.write_text("0\n" if eligible else "1\n", "ascii")
            self._written = eligible
        if now - self._touched >= TOUCH_PERIOD:
            assert self._lock is not None
            os.utime(self._lock)
            self._touched = now

    def _open(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self.path.write_text("1\n", "ascii")
        self._written = False
        lock = os.open(self.alive, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, _MODE)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            raise OSError(None, "another gateway on this machine has the cell") from None
        self._lock = lock
