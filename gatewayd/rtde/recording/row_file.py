"""A file of rows that is whole at any moment: it ends with the last row that was flushed, whatever happens."""

from __future__ import annotations

import errno
import fcntl
import os
import stat
from contextlib import suppress
from itertools import accumulate
from pathlib import Path

from gatewayd.report.format import counted
from gatewayd.rtde.recording.errors import RecordingError, RecordingExistsError, RecordingWriteError


class RowFile:
    """Takes rows and hands them to the operating system, several at a time.

    A row is written whole or, where that fails, cut off again: no reader meets half a row, unless the machine itself
    stops. Rows that were flushed outlive the process. After a failure nothing more is taken.
    """

    def __init__(
        self, path: str | Path, head: bytes = b"", *, overwrite: bool = False, flush_every: int = 1
    ) -> None:
        """Create the file, with what stands before its rows.

        RecordingExistsError if it is there and not to be overwritten, RecordingError for whatever else is in the way:
        also another process that writes it.
        """
        self.path = str(path)
        self._flush_every = max(1, flush_every)
        self._waiting: list[bytes] = []
        self._failure: RecordingError | None = None
        self._closed = False
        self.size = 0
        """Bytes in the file."""
        self.rows = 0
        """Rows in the file, without those that wait to be flushed."""
        new = 0 if overwrite else os.O_EXCL
        try:
            # Not blocking: a pipe that nobody reads would hold it up for ever, Ctrl-C included.
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK | new, 0o666)
            os.set_blocking(self._file, True)
        except FileExistsError:
            raise RecordingExistsError(self.path) from None
        except (OSError, ValueError) as error:
            raise RecordingWriteError(self.path, error, "cannot be written: {reason}") from error
        try:
            self._take_over()
            self._write(head)
        except RecordingError:
            os.close(self._file)
            raise
        except OSError as error:
            os.close(self._file)
            raise RecordingWriteError(self.path, error, "cannot be written: {reason}") from error
        self.size = len(head)

    def append(self, row: bytes) -> None:
        """Take a row. Raises RecordingError where it, or one before it, cannot be written."""
        if self._failure is not None:
            raise self._failure
        self._waiting.append(row)
        if len(self._waiting) >= self._flush_every:
            self.flush()

    def flush(self) -> None:
        """Write the rows that wait. Raises RecordingError; the file then ends with the last row that found room."""
        if not self._waiting:
            return
        data = b"".join(self._waiting)
        try:
            self._write(data)
        except OSError as error:
            raise self._fail(error) from error
        size, rows, empty = self.size + len(data), self.rows + len(self._waiting), list[bytes]()
        # Between the following stores Python lets no signal in, so the rows are counted once.
        self.size, self.rows, self._waiting = size, rows, empty

    def close(self) -> None:
        """Flush and close, once; raises RecordingError where the system reports only now that it could not write."""
        if self._closed:
            return
        self._closed = True
        try:
            if self._failure is None:
                self.flush()
                self._sync()
        finally:
            os.close(self._file)

    def _take_over(self) -> None:
        """Lock the file as long as it is open, and empty it. Two that write at once would spoil each other's rows."""
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise RecordingError(
                f"{self.path}: another recording is writing it; choose another name"
            ) from error
        except OSError:
            pass  # a file system without locks
        if stat.S_ISREG(os.fstat(self._file).st_mode):
            os.ftruncate(self._file, 0)

    def _write(self, data: bytes) -> None:
        # At its place, not at the end: whoever interrupts this and flushes again writes the same bytes again.
        done = 0
        while done < len(data):
            done += os.pwrite(self._file, data[done:], self.size + done)

    def _fail(self, error: OSError) -> RecordingError:
        """Cut off what is no whole row, and take no other."""
        found = os.fstat(self._file).st_size - self.size
        ends = [end for end in accumulate(map(len, self._waiting)) if end <= found]
        self.rows += len(ends)
        self.size += ends[-1] if ends else 0
        self._waiting = []
        with suppress(OSError):
            os.ftruncate(self._file, self.size)
        outcome = f"{{reason}}; the file has {counted(self.rows, 'row')}, all of them whole"
        self._failure = RecordingWriteError(self.path, error, outcome)
        return self._failure

    def _sync(self) -> None:
        try:
            os.fsync(self._file)
        except OSError as error:
            if error.errno != errno.EINVAL:  # what a device answers that keeps nothing
                raise RecordingWriteError(self.path, error, "may lack its end: {reason}") from error
