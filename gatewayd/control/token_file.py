"""The file of tokens on the disk: read as the gateway reads it, changed as the commands do, whole or not at all."""

from __future__ import annotations

import fcntl
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

from gatewayd.control.tokens import TokenFileError, TokenSet, as_text, parse
from gatewayd.whole_file import whole_file

MODE = 0o640
"""Its owner changes it; the group, the service's, reads it."""
MAX_FILE = 64 * 1024


def read_tokens(path: Path) -> TokenSet:
    """What is in the file. Raises TokenFileError, with the file's name; FileNotFoundError where there is none."""
    try:
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            raise TokenFileError(f"{path}: not a regular file")
        if mode & (stat.S_IROTH | stat.S_IWOTH):
            raise TokenFileError(f"{path}: others may read or change it; run: chmod o-rw {path}")
        with path.open("rb") as stream:
            text = stream.read(MAX_FILE + 1)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise TokenFileError(f"{path}: {error.strerror}") from error
    if len(text) > MAX_FILE:
        raise TokenFileError(f"{path}: more than {MAX_FILE // 1024} KiB")
    try:
        return parse(text)
    except TokenFileError as error:
        raise TokenFileError(f"{path}: {error}") from error


def change_tokens(path: Path, change: Callable[[TokenSet], TokenSet]) -> None:
    """Replace the file by what `change` makes of it; one change after another. Raises TokenFileError and OSError."""
    with _alone(path.parent):
        try:
            present = read_tokens(path)
        except FileNotFoundError:
            present = TokenSet()
        text = as_text(change(present))
        # Else it would get the group of the user who writes it, and the service could not read it.
        is_new = not path.exists()
        group = (path.parent if is_new else path).stat().st_gid
        with whole_file(path, overwrite=True) as unfinished:
            opened = os.open(unfinished, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o600)
            with os.fdopen(opened, "w") as stream:
                stream.write(text)
                if os.fstat(opened).st_gid != group:
                    with suppress(PermissionError) if is_new else nullcontext():
                        os.fchown(opened, -1, group)
                os.fchmod(opened, MODE)


@contextmanager
def _alone(directory: Path) -> Iterator[None]:
    """Two commands at once must not lose what one of them does."""
    opened = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX)
        yield
    finally:
        os.close(opened)
