"""Reading recordings of either format and any writer."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Protocol, Self

from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.recording.binary_reader import BinaryReader
from gatewayd.rtde.recording.csv_reader import MAX_LINE, CsvReader
from gatewayd.rtde.recording.errors import RecordingError
from gatewayd.rtde.recording.parquet import MAGIC, ParquetReader
from gatewayd.rtde.types import DataType

_ELEMENTS = {kind.word for kind in DataType if not kind.is_vector}
_DELIMITER = re.compile(r'[^\w"]', re.ASCII)
_BOM = "\ufeff"
_BOMS_UTF_16 = (b"\xff\xfe", b"\xfe\xff")


class RecordingReader(Protocol):
    """A recording that is read package by package. As a context manager it is closed at the end.

    Iterating begins with the first package each time, so a recording can be replayed in a loop.
    """

    recipe: Recipe
    """The fields. Text has no types: they are those of the guides then, and DOUBLE for other names."""
    host_time: bool
    """Whether the recording has host time."""
    torn: str
    """What was left out at the end, in words, once it was reached: a last package that is not whole. Else empty."""
    total: int
    """Bytes of the file."""
    position: int
    """Bytes that were read."""

    def __iter__(self) -> Iterator[tuple[Scalar, ...]]:
        """The packages, each as flat values of the recipe. RecordingError names the line that cannot be read."""

    def rows(self) -> Iterator[tuple[tuple[Scalar, ...], float | None]]:
        """The packages with their host time; None in a recording without."""

    def close(self) -> None:
        """Close the file."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *problem: object) -> None: ...


def open_recording(path: str | Path, *, delimiter: str | None = None) -> RecordingReader:
    """A recording for reading; whether it is text, binary or Parquet, and what separates its columns, its head shows.

    Raises RecordingError for a file that cannot be opened or is no recording, MissingExtraError for Parquet without its
    extra.
    """
    try:
        file = Path(path).open("rb")  # noqa: SIM115 - the reader closes it
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise RecordingError(f"{path}: cannot be read: {reason}") from error
    try:
        return _opened(file, str(path), delimiter)
    except BaseException:
        file.close()
        raise


def _opened(file: BinaryIO, path: str, delimiter: str | None) -> RecordingReader:
    start = file.readline(MAX_LINE)
    if start.startswith(MAGIC):
        file.close()
        return ParquetReader(path)
    if b"\0" in start or start.startswith(_BOMS_UTF_16):
        raise RecordingError(f"{path}:1: no recording: it is UTF-16, or no text at all; save it as UTF-8")
    first = _text(start)
    if not first.endswith("\n"):
        raise RecordingError(f"{path}:1: no recording: it has no line with the names of its columns")
    header = first.strip("\r\n").removeprefix(_BOM)
    separator = delimiter if delimiter is not None else _separator(header)
    names = [name.strip('"') for name in header.split(separator)]
    second = file.tell()
    types = _text(file.readline(MAX_LINE)).removesuffix("\n").split(separator)
    try:
        if set(types) <= _ELEMENTS and len(types) == len(names):
            return BinaryReader(file, path, names, [DataType.from_word(word) for word in types])
        file.seek(second)
        return CsvReader(file, path, names, separator)
    except (OSError, ValueError) as error:
        raise RecordingError(f"{path}:1: no recording: {error}") from error


def _separator(header: str) -> str:
    """What separates the columns: the first sign that no name has; a space where there is but one column."""
    found = _DELIMITER.search(header)
    return found[0] if found is not None else " "


def _text(line: bytes) -> str:
    return line.decode(errors="backslashreplace")
