"""Several generated files into one folder, without losing what somebody changed by hand."""

from __future__ import annotations

import errno
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from gatewayd.whole_file import whole_file

if TYPE_CHECKING:
    from gatewayd.links.exports import ExportedFile

State = Literal["new", "renewed", "the same", "yours, left alone", "changed by hand"]


@dataclass(frozen=True, slots=True)
class Planned:
    """A file, and what is to happen to it."""

    path: Path
    content: bytes
    state: State

    @property
    def is_written(self) -> bool:
        """Whether it is put there."""
        return self.state in ("new", "renewed")


def planned(folder: Path, files: Sequence[ExportedFile], *, force: bool) -> tuple[Planned, ...]:
    """What is to happen to each file, looked at before any is written. Raises OSError."""
    return tuple(_planned(folder, files, force=force))


def _planned(folder: Path, files: Sequence[ExportedFile], *, force: bool) -> Iterator[Planned]:
    for file in files:
        path, content = folder / file.name, file.content()
        yield Planned(path, content, _state(path, content, once=file.once, force=force))


def _state(path: Path, content: bytes, *, once: bool, force: bool) -> State:
    from gatewayd.links.exports import is_as_generated

    try:
        if not path.is_dir() and path.exists() and not path.is_file():
            # To read a pipe would wait, and a device may have no end.
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        there = path.read_bytes()
    except FileNotFoundError:
        return "new"
    if there == content:
        return "the same"
    if once:
        return "yours, left alone"
    return "renewed" if force or is_as_generated(there) else "changed by hand"


def write(files: Sequence[Planned]) -> None:
    """Put them there; a file is whole or as it was. Raises OSError."""
    for file in files:
        if file.is_written:
            file.path.parent.mkdir(parents=True, exist_ok=True)
            with whole_file(file.path, overwrite=True) as unfinished:
                unfinished.write_bytes(file.content)
