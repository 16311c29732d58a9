"""Reading the binary format: payloads of one length, one behind the other."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator, Sequence
from typing import BinaryIO, Self

from gatewayd.report.format import counted
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.recording.layout import fields_of
from gatewayd.rtde.types import DataType

_BLOCK = 1 << 18
"""Bytes that are read together."""


class BinaryReader:
    """A binary recording; see `RecordingReader`. The file stands at its first package."""

    def __init__(self, file: BinaryIO, path: str, names: Sequence[str], types: Sequence[DataType]) -> None:
        self.recipe, self.host_time = fields_of(names, types)
        self.torn = ""
        self.total = os.fstat(file.fileno()).st_size
        self.position = self._start = file.tell()
        self._file = file
        self._path = path
        self._row = struct.Struct(">" + "".join(kind.format for kind in types))

    def __iter__(self) -> Iterator[tuple[Scalar, ...]]:
        """The packages, each as flat values of the recipe."""
        return (values for values, _time in self.rows())

    def rows(self) -> Iterator[tuple[tuple[Scalar, ...], float | None]]:
        """The packages with their host time."""
        size, together = self._row.size, max(1, _BLOCK // self._row.size)
        self.torn = ""
        self._file.seek(self._start)
        while block := self._file.read(size * together):
            whole = len(block) - len(block) % size
            for values in self._row.iter_unpack(block[:whole]):
                yield (values[:-1], values[-1]) if self.host_time else (values, None)
            self.position = self._file.tell()
            if whole < len(block):
                left = counted(len(block) - whole, "byte")
                self.torn = f"{self._path}: {left} at the end are no whole package and were left out"

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        self.close()
