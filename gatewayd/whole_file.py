"""Files that are there whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_NO_LINKS = {errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK}
"""What file systems without links answer."""
_SHOWN = 50
"""Characters of the file's name in that of the unfinished one: a name has 255 bytes, a character up to four."""


@contextmanager
def whole_file(path: str | Path, *, overwrite: bool) -> Iterator[Path]:
    """A path beside `path` to write to; what is written gets its name when the block ends.

    Until then, and if the block raises or the machine stops, `path` is what it was. A file that is replaced keeps its
    permissions, a link stays one. What is no regular file, as a pipe or a terminal, is written to as it is. OSError;
    FileExistsError without `overwrite`, also for a file that came in the meantime.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        yield target
        return
    unfinished = target.with_name(f".{target.name[:_SHOWN]}.{os.getpid()}.part")
    try:
        yield unfinished
        _sync(unfinished)
        if overwrite:
            with suppress(FileNotFoundError):
                unfinished.chmod(stat.S_IMODE(target.stat().st_mode))
            unfinished.replace(target)
        else:
            _name(unfinished, target)
        _sync(target.parent)
    finally:
        unfinished.unlink(missing_ok=True)


def _name(unfinished: Path, target: Path) -> None:
    """Give the file its name by a link, which replaces nothing; where there are none, as well as can be."""
    try:
        target.hardlink_to(unfinished)
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        if os.path.lexists(target):
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target)) from error
        unfinished.rename(target)


def _sync(path: Path) -> None:
    """Have it on the disk."""
    opened = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(opened)
    except OSError as error:
        if error.errno != errno.EINVAL:  # what file systems answer that have nothing to write
            raise
    finally:
        os.close(opened)
