"""Writing recordings, in the text and in the binary format of the official Python client.

Both begin with a line of the column names. In the text each package is a line of numbers: what `csv_reader.CSVReader`
and the plotters of that client take, booleans as 0 and 1 (it cannot read the `True` and `False` of its own writer) and
floats with every digit that matters. In the binary format (`csv_binary_writer.CSVBinaryWriter`) a line of the columns'
types follows, and then the payloads of the packages as the controller sent them, big-endian, nothing between them.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Self

from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.recording.layout import column_types, columns
from gatewayd.rtde.recording.row_file import RowFile
from gatewayd.rtde.recording.row_text import RowText

_TIME = struct.Struct(">d")
_NO_DELIMITERS = frozenset("+-._\"'\r\n\0")


Row = Callable[[bytes, float], bytes]
"""Makes a row of a payload and the host time."""


class RecordingWriter:
    """A recording that is being written. As a context manager it is closed at the end."""

    def __init__(self, file: RowFile, recipe: Recipe, row: Row) -> None:
        self._file = file
        self._recipe = recipe
        self._row = row

    @property
    def packages(self) -> int:
        """Packages that are in the file."""
        return self._file.rows

    @property
    def size(self) -> int:
        """Bytes of the file."""
        return self._file.size

    def write(self, values: Sequence[Scalar], host_time: float = 0.0) -> None:
        """Add a package: flat values of the recipe, and the time for a recording with host time.

        ValueError for values that do not fit the recipe, RecordingError where the file cannot take more (a full disk);
        it then ends with the last package that found room, and takes no other.
        """
        self._file.append(self._row(self._recipe.pack(values), host_time))

    def write_payload(self, payload: bytes, host_time: float = 0.0) -> None:
        """Add a package as it came: its bytes without the recipe id, as many as the recipe has; else ValueError."""
        if len(payload) != self._recipe.size:
            raise ValueError(f"a payload of {len(payload)} B, where the recipe has {self._recipe.size} B")
        self._file.append(self._row(payload, host_time))

    def flush(self) -> None:
        """Hand what waits to the operating system; RecordingError as for `write`."""
        self._file.flush()

    def close(self) -> None:
        """Flush and close; a second time does nothing."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        self.close()


def create_recording(
    path: str | Path,
    recipe: Recipe,
    *,
    binary: bool = False,
    delimiter: str = " ",
    host_time: bool = False,
    overwrite: bool = False,
    flush_every: int = 1,
) -> RecordingWriter:
    """A new recording of packages of this recipe, with its header written.

    `flush_every` packages are handed to the operating system together; those that wait are lost if the process is
    killed. Raises RecordingExistsError, RecordingError; ValueError for a delimiter that numbers or names may contain.
    """
    check_delimiter(delimiter)
    head = delimiter.join(columns(recipe, host_time=host_time)) + "\n"
    if binary:
        types = column_types(recipe, host_time=host_time)
        head += delimiter.join(kind.word for kind in types) + "\n"
    row = _binary_row(host_time=host_time) if binary else _text_row(recipe, delimiter, host_time=host_time)
    file = RowFile(path, head.encode(), overwrite=overwrite, flush_every=flush_every)
    return RecordingWriter(file, recipe, row)


def check_delimiter(delimiter: str) -> None:
    """ValueError unless it is one character that neither a number nor a name may contain."""
    if len(delimiter) != 1 or not delimiter.isascii() or delimiter.isalnum() or delimiter in _NO_DELIMITERS:
        raise ValueError(
            f"{delimiter!r} cannot separate columns; take a space, a comma, a semicolon or a tab"
        )


def _text_row(recipe: Recipe, delimiter: str, *, host_time: bool) -> Row:
    line = RowText(recipe, delimiter).line
    if host_time:
        return lambda payload, time: f"{line(payload)}{delimiter}{time!r}\n".encode()
    return lambda payload, _time: f"{line(payload)}\n".encode()


def _binary_row(*, host_time: bool) -> Row:
    if host_time:
        return lambda payload, time: payload + _TIME.pack(time)
    return lambda payload, _time: payload
