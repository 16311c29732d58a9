"""Finished recordings from one format to another, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import Path
from typing import NamedTuple

from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.recording.errors import RecordingError, RecordingExistsError, RecordingWriteError
from gatewayd.rtde.recording.gaps import SUFFIX, GapWriter, read_gaps
from gatewayd.rtde.recording.parquet import write_parquet
from gatewayd.rtde.recording.reading import RecordingReader, open_recording
from gatewayd.rtde.recording.writing import check_delimiter, create_recording
from gatewayd.whole_file import whole_file

_TOGETHER = 256
"""Packages that are written together."""


class Converted(NamedTuple):
    """What a conversion took over."""

    packages: int
    torn: str
    """What was left out at the end, in words; empty if nothing was."""


class RecordingFormat(Enum):
    """A format of recordings, and the endings that names of such files have."""

    CSV = ("csv", (".csv", ".txt", ".tsv"))
    BINARY = ("binary", (".bin",))
    PARQUET = ("parquet", (".parquet", ".pq"))

    def __init__(self, word: str, endings: tuple[str, ...]) -> None:
        self.word = word
        """Name on the command line."""
        self.endings = endings

    @classmethod
    def of_name(cls, path: str | Path) -> RecordingFormat | None:
        """The format that the ending of a name stands for; None: it stands for none."""
        ending = Path(path).suffix.lower()
        return next((member for member in cls if ending in member.endings), None)


def convert(
    source: str | Path,
    target: str | Path,
    form: RecordingFormat,
    *,
    delimiters: tuple[str | None, str] = (None, " "),
    overwrite: bool = False,
    progress: Callable[[RecordingReader, int], None] = lambda _recording, _packages: None,
) -> Converted:
    """Write a finished recording to `target` in another format, its gaps beside it.

    The file appears under its name once it is finished. `delimiters` are those of the source (None: found out) and of
    the target; `progress` is called with the number of packages so far. Raises RecordingExistsError, RecordingError,
    MissingExtraError, and ValueError for a delimiter.
    """
    check_delimiter(delimiters[1])
    for made in (str(target), f"{target}{SUFFIX}"):
        if not overwrite and os.path.lexists(made):
            raise RecordingExistsError(made)
    if Path(target).exists() and Path(target).samefile(source):
        raise RecordingError(f"{target}: is the recording itself; choose another name")
    gaps = read_gaps(source)
    with open_recording(source, delimiter=delimiters[0]) as recording:
        try:
            with whole_file(target, overwrite=overwrite) as unfinished:
                count = _write(recording, unfinished, form, delimiters[1], progress)
        except FileExistsError:
            raise RecordingExistsError(str(target)) from None
        except RecordingWriteError as error:
            raise RecordingError(f"{target}: cannot be written: {error.reason}") from error
        except OSError as error:
            raise RecordingError(f"{target}: cannot be written: {error.strerror or error}") from error
        torn = recording.torn
    with GapWriter(target, overwrite=overwrite) as writer:
        for gap in gaps:
            writer.write(gap)
    return Converted(count, torn)


def _write(
    recording: RecordingReader,
    path: Path,
    form: RecordingFormat,
    delimiter: str,
    progress: Callable[[RecordingReader, int], None],
) -> int:
    """How many packages were written."""
    count = 0

    def rows() -> Iterator[tuple[tuple[Scalar, ...], float | None]]:
        nonlocal count
        for row in recording.rows():
            yield row
            count += 1
            if count % _TOGETHER == 0:
                progress(recording, count)

    if form is RecordingFormat.PARQUET:
        write_parquet(rows(), path, recording.recipe, host_time=recording.host_time)
        return count
    with create_recording(
        path,
        recording.recipe,
        binary=form is RecordingFormat.BINARY,
        delimiter=delimiter,
        host_time=recording.host_time,
        overwrite=True,
        flush_every=_TOGETHER,
    ) as writer:
        for values, time in rows():
            writer.write(values, time or 0.0)
    return count
