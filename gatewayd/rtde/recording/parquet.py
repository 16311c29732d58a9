"""Recordings as Parquet files, by the extra `parquet`: for whatever evaluates more data than a text file carries.

The columns are named as in the other formats and have the types of the recipe; the unit of a field is in the metadata
of its columns. A Parquet file is finished at its end, so one is made of a recording and is not recorded into.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from io import SEEK_END, RawIOBase
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Self

from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.recording.errors import MissingExtraError, RecordingError, RecordingWriteError
from gatewayd.rtde.recording.layout import HOST_TIME, column_types, columns, fields_of
from gatewayd.rtde.types import DataType

if TYPE_CHECKING:
    from gatewayd.rtde.recipe import Recipe, Scalar

MAGIC = b"PAR1"
"""The first bytes of every Parquet file."""

_END = struct.Struct("<I4s")
"""How a file ends: the length of what describes it, which stands before, and MAGIC."""
_TOGETHER = 4096
"""Packages that are turned into columns together."""
_GROUP = 1 << 17
"""Packages of a row group at most."""
_COMPRESSION = "zstd(3)"


def write_parquet(
    rows: Iterator[tuple[tuple[Scalar, ...], float | None]],
    path: str | Path,
    recipe: Recipe,
    *,
    host_time: bool,
) -> None:
    """Write rows of flat values and host time to a Parquet file, which is overwritten. In memory are few at a time.

    Raises RecordingError, MissingExtraError, and whatever `rows` raises.
    """
    core, io = _library()
    names, kinds = columns(recipe, host_time=host_time), column_types(recipe, host_time=host_time)
    units = _units(recipe)
    schema = core.Schema(
        [
            core.Field(
                name,
                _arrow(core, kind),
                nullable=False,
                metadata={"unit": units[name]} if name in units else None,
            )
            for name, kind in zip(names, kinds, strict=True)
        ]
    )
    flat = ((*values, time) for values, time in rows) if host_time else (values for values, _time in rows)
    failures: list[BaseException] = []
    try:
        with Path(path).open("wb") as file:
            io.write_parquet(
                core.RecordBatchReader.from_batches(schema, _batches(core, schema, kinds, flat, failures)),
                _Output(file, failures),
                compression=_COMPRESSION,
                max_row_group_size=_GROUP,
            )
    except OSError as error:
        raise RecordingWriteError(str(path), error, "cannot be written: {reason}") from error
    except Exception as error:
        if not failures:
            raise RecordingError(f"{path}: cannot be written: {error}") from error
    if failures:
        failure = failures[0]
        if isinstance(failure, OSError):
            raise RecordingWriteError(str(path), failure, "cannot be written: {reason}")
        raise failure


class _Output(RawIOBase):
    """A file that takes everything: what fails, an interrupt too, is kept: the library would make a text of it."""

    def __init__(self, file: BinaryIO, failures: list[BaseException]) -> None:
        self._file = file
        self._failures = failures

    def writable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        try:
            if not self._failures:
                self._file.write(data)
                self._file.flush()
        except BaseException as error:  # noqa: BLE001 - raised again once the library has ended
            self._failures.append(error)
        return len(data)


def _batches(
    core: Any,
    schema: Any,
    kinds: tuple[DataType, ...],
    rows: Iterator[tuple[Any, ...]],
    failures: list[BaseException],
) -> Iterator[Any]:
    """The rows as columns, until something fails: that is kept, because the library would make a text of it."""
    try:
        while not failures and (block := list(islice(rows, _TOGETHER))):
            found = zip(kinds, zip(*block, strict=True), strict=True)
            yield core.RecordBatch.from_arrays(
                [_column(core, kind, values) for kind, values in found], schema=schema
            )
    except BaseException as error:
        failures.append(error)
        raise


def _column(core: Any, kind: DataType, values: tuple[Any, ...]) -> Any:
    if kind is DataType.BOOL:
        return core.Array(list(values), type=_arrow(core, kind))
    return core.Array(array(kind.code, values))


class ParquetReader:
    """A recording in a Parquet file; see `RecordingReader`."""

    def __init__(self, path: str) -> None:
        """Open it. Raises RecordingError for columns that no RTDE field can have, MissingExtraError."""
        self._path = path
        self._core, self._io = _library()
        _check_end(path)
        self.total = Path(path).stat().st_size
        self.position = 0
        self.torn = ""
        with _refusing(path):
            schema = self._io.read_parquet(path).schema
            names = [schema.field(place).name for place in range(len(schema))]
            types = [self._type(schema.field(place)) for place in range(len(schema))]
        try:
            self.recipe, self.host_time = fields_of(names, types)
        except ValueError as error:
            raise RecordingError(f"{path}: no recording: {error}") from error

    def _type(self, field: Any) -> DataType:
        for kind in DataType:
            if not kind.is_vector and field.type.equals(_arrow(self._core, kind)):
                return kind
        found = str(field.type).strip()
        raise RecordingError(
            f"{self._path}: the column {field.name} is {found}, which no field of RTDE is; leave it out"
        )

    def __iter__(self) -> Iterator[tuple[Scalar, ...]]:
        """The packages, each as flat values of the recipe."""
        return (values for values, _time in self.rows())

    def rows(self) -> Iterator[tuple[tuple[Scalar, ...], float | None]]:
        """The packages with their host time."""
        with _refusing(self._path):
            batches = iter(self._io.read_parquet(self._path, batch_size=_TOGETHER))
        while True:
            with _refusing(self._path):
                batch = next(batches, None)
                if batch is None:
                    break
                found = [batch.column(place).to_pylist() for place in range(batch.num_columns)]
            for values in zip(*found, strict=True):
                if None in values:
                    raise RecordingError(f"{self._path}: a package lacks a value; leave it out")
                yield (values[:-1], values[-1]) if self.host_time else (values, None)
        self.position = self.total

    def close(self) -> None:
        """Nothing stays open."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *problem: object) -> None:
        self.close()


def _check_end(path: str) -> None:
    """RecordingError for a file without its end, about which the library would print a panic of its own."""
    with Path(path).open("rb") as file:
        size = file.seek(0, SEEK_END)
        file.seek(-min(size, _END.size), SEEK_END)
        end = file.read(_END.size)
    length, magic = _END.unpack(end.rjust(_END.size, b"\0"))
    if magic != MAGIC or length > size - len(MAGIC) - _END.size:
        raise RecordingError(
            f"{path}: no recording: this Parquet file lacks its end; convert the recording again"
        )


@contextmanager
def _refusing(path: str) -> Iterator[None]:
    """Whatever the library has against a file, as one error."""
    try:
        yield
    except (RecordingError, KeyboardInterrupt):
        raise
    except BaseException as error:  # a panic of the library is no Exception
        raise RecordingError(f"{path}: no recording: {error}") from error


def _library() -> tuple[Any, Any]:
    try:
        from arro3 import core, io
    except ImportError as error:
        raise MissingExtraError("A Parquet file", "parquet", "arro3-io") from error
    return core, io


def _arrow(core: Any, kind: DataType) -> Any:
    make = {"?": "bool", "B": "uint8", "I": "uint32", "Q": "uint64", "i": "int32", "d": "float64"}[kind.code]
    return getattr(core.DataType, make)()


def _units(recipe: Recipe) -> dict[str, str]:
    """Column -> unit, as far as the guides state one."""
    found = {HOST_TIME: "s"}
    names = columns(recipe)
    for name, slot in recipe.slots.items():
        field = OUTPUTS.get(name) or INPUTS.get(name)
        if field is not None and field.unit:
            found |= dict.fromkeys(names[slot], field.unit)
    return found
