"""Reading the text format, as strictly as numbers need it and as loosely as its writers differ.

Taken is whatever the official client has written, and other tools made of it: either line end and empty lines between
the rows, `True` and `False`, `[7]` for a single integer, quotation marks, any delimiter.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Iterator, Sequence
from typing import BinaryIO, Self

from gatewayd.report.format import counted
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.recording.errors import RecordingError
from gatewayd.rtde.recording.layout import column_types, fields_of
from gatewayd.rtde.types import DataType

MAX_LINE = 1 << 20
"""Bytes of a line at most; all fields that there are take some 10 kB."""

_BOOLEANS = {b"0": False, b"1": True, b"False": False, b"True": True}


class CsvReader:
    """A recording of text; see `RecordingReader`. The file stands at its second line."""

    def __init__(self, file: BinaryIO, path: str, names: Sequence[str], delimiter: str) -> None:
        self.recipe, self.host_time = fields_of(names)
        self.torn = ""
        self.total = os.fstat(file.fileno()).st_size
        self.position = self._start = file.tell()
        self._file = file
        self._path = path
        self._names = names
        self._delimiter = delimiter
        self._types = column_types(self.recipe, host_time=self.host_time)
        self._read = [_READERS.get(kind, int) for kind in self._types]

    def __iter__(self) -> Iterator[tuple[Scalar, ...]]:
        """The packages, each as flat values of the recipe."""
        return (values for values, _time in self.rows())

    def rows(self) -> Iterator[tuple[tuple[Scalar, ...], float | None]]:
        """The packages with their host time."""
        for number, line in self._lines():
            values = self._values(number, self._cells(number, line))
            packed = values[:-1] if self.host_time else values
            try:
                self.recipe.pack(packed)
            except ValueError as error:
                raise self._error(number, f"{error}; is it a recording of RTDE?") from error
            yield packed, float(values[-1]) if self.host_time else None

    def _lines(self) -> Iterator[tuple[int, bytes]]:
        """The lines with something in them, and their numbers; not a last one that has no end."""
        self.torn = ""
        self._file.seek(self._start)
        self.position = self._start
        number = 1
        while line := self._file.readline(MAX_LINE):
            number += 1
            self.position += len(line)
            if not line.endswith(b"\n"):
                if self._file.read(1):
                    raise self._error(number, "the line has no end; is it a recording of RTDE?")
                self.torn = f"{self._path}:{number}: the last line is not whole and was left out"
            elif line := line.strip(b"\r\n"):
                yield number, line

    def _cells(self, number: int, line: bytes) -> Sequence[bytes]:
        if b'"' not in line:
            return line.split(self._delimiter.encode())
        text = line.decode(errors="backslashreplace")
        try:
            return [cell.encode() for row in csv.reader([text], delimiter=self._delimiter) for cell in row]
        except csv.Error as error:
            text = "the line cannot be split into columns; is it a recording of RTDE?"
            raise self._error(number, text) from error

    def _values(self, number: int, cells: Sequence[bytes]) -> tuple[Scalar, ...]:
        if len(cells) != len(self._names):
            columns = counted(len(cells), "column")
            raise self._error(number, f"{columns}, where the first line has {len(self._names)}")
        try:
            return tuple([read(cell) for read, cell in zip(self._read, cells, strict=True)])
        except (ValueError, KeyError):
            return tuple(self._value(number, place, cell) for place, cell in enumerate(cells))

    def _value(self, number: int, place: int, cell: bytes) -> Scalar:
        """A value that may be written as nobody should."""
        kind = self._types[place]
        bare = cell.strip(b" []")
        try:
            if kind is DataType.DOUBLE:
                return float(_BOOLEANS.get(bare) or bare)
            if kind is DataType.BOOL:
                return _BOOLEANS[bare] if bare in _BOOLEANS else {0.0: False, 1.0: True}[float(bare)]
            return _whole(bare)
        except (ValueError, KeyError, OverflowError):
            found = cell[:40].decode(errors="backslashreplace")
            text = f"{found!r} in column {self._names[place]} is no {kind.word}"
            raise self._error(number, f"{text}; correct the cell, or leave out the line") from None

    def _error(self, number: int, text: str) -> RecordingError:
        return RecordingError(f"{self._path}:{number}: {text}")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        self.close()


def _whole(cell: bytes) -> int:
    """An integer, also one that is written as a float."""
    try:
        return int(cell)
    except ValueError:
        number = float(cell)
        if not number.is_integer():
            raise
        return int(number)


_READERS: dict[DataType, Callable[[bytes], Scalar]] = {
    DataType.DOUBLE: float,
    DataType.BOOL: _BOOLEANS.__getitem__,
}
