"""Recordings as Parquet files."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from arro3 import core, io
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.recording import MissingExtraError, RecordingError, open_recording
from gatewayd.rtde.recording.layout import columns
from gatewayd.rtde.recording.parquet import _Output, write_parquet
from tests.rtde.recording.samples import PACKAGES, RECIPE, packages_of, recipes


def rows(count: int = 2) -> Iterator[tuple[tuple[Scalar, ...], float | None]]:
    return ((PACKAGES[number % 2], 17.5 + number) for number in range(count))


def test_columns_types_units_and_values_are_those_of_the_recipe(tmp_path: Path) -> None:
    path = tmp_path / "x.parquet"
    write_parquet(rows(), path, RECIPE, host_time=True)
    table = io.read_parquet(path).read_all()
    assert tuple(table.column_names) == columns(RECIPE, host_time=True)
    assert [
        str(table.schema.field(name).type).split("<")[1].strip(">\n") for name in table.column_names[6:9]
    ] == [
        "Float64",
        "UInt64",
        "Int32",
    ]
    assert table.schema.field("timestamp").metadata == {b"unit": b"s"}
    assert [table.column(name).to_pylist() for name in ("actual_digital_input_bits", "host_time")] == [
        [2**64 - 1, 0],
        [17.5, 18.5],
    ]


@given(st.data(), st.booleans())
def test_what_is_written_is_read(data: st.DataObject, host_time: bool) -> None:
    recipe = data.draw(recipes())
    packages = data.draw(st.lists(packages_of(recipe), max_size=5))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x"
        write_parquet(((values, 1.5) for values in packages), path, recipe, host_time=host_time)
        with open_recording(path) as found:
            assert (found.recipe.names, found.recipe.types, found.host_time) == (
                recipe.names,
                recipe.types,
                host_time,
            )
            expected = [(values, 1.5 if host_time else None) for values in packages]
            assert repr(list(found.rows())) == repr(expected)
            assert repr(list(found)) == repr(packages)
            assert found.position == found.total == path.stat().st_size


def test_more_packages_than_are_in_memory(tmp_path: Path) -> None:
    path = tmp_path / "x.parquet"
    write_parquet(rows(10_001), path, RECIPE, host_time=True)
    with open_recording(path) as found:
        assert [time for _values, time in found.rows()] == [17.5 + number for number in range(10_001)]


@pytest.mark.parametrize("failure", [KeyboardInterrupt(), RecordingError("x:7: no"), ZeroDivisionError()])
def test_what_goes_wrong_with_the_rows_comes_as_it_is(tmp_path: Path, failure: BaseException) -> None:
    def broken() -> Iterator[tuple[tuple[Scalar, ...], float | None]]:
        yield from rows()
        raise failure

    with pytest.raises(type(failure)) as error:
        write_parquet(broken(), tmp_path / "x", RECIPE, host_time=False)
    assert error.value is failure


def test_a_place_where_nothing_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"x: cannot be written: .*No such file"):
        write_parquet(rows(), tmp_path / "no" / "x", RECIPE, host_time=False)


def foreign(path: Path, kind: Any, values: list[Any]) -> None:
    schema = core.Schema([core.Field("name", kind, nullable=True)])
    batch = core.RecordBatch.from_arrays([core.Array(values, type=kind)], schema=schema)
    io.write_parquet(core.RecordBatchReader.from_batches(schema, [batch]), path)


def test_columns_that_no_field_can_have_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.parquet"
    foreign(path, core.DataType.utf8(), ["a"])
    with pytest.raises(RecordingError, match=r"the column name is .*Utf8.*, which no field of RTDE is"):
        open_recording(path)


def test_a_missing_value_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.parquet"
    foreign(path, core.DataType.float64(), [1.0, None])
    with open_recording(path) as found, pytest.raises(RecordingError, match="a package lacks a value"):
        list(found)


@pytest.mark.parametrize("kept", [4, 7, 12, 300, -1])
def test_a_file_without_its_end_is_refused_in_our_words(
    tmp_path: Path, kept: int, capfd: pytest.CaptureFixture[str]
) -> None:
    """The library panics, and prints that by itself."""
    path = tmp_path / "x.parquet"
    write_parquet(rows(), path, RECIPE, host_time=False)
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(RecordingError, match="this Parquet file lacks its end; convert the recording again"):
        open_recording(path)
    assert capfd.readouterr().err == ""


@given(st.data())
def test_any_bytes_are_read_or_refused(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x"
        write_parquet(rows(), path, RECIPE, host_time=False)
        content = bytearray(path.read_bytes())
        for place in data.draw(st.lists(st.integers(4, len(content) - 1), max_size=8)):
            content[place] = data.draw(st.integers(0, 255))
        path.write_bytes(content[: data.draw(st.integers(0, len(content)) | st.just(len(content)))])
        try:
            with open_recording(path) as found:
                list(found)
        except RecordingError as error:
            assert str(error).startswith(f"{path}:")  # noqa: PT017 - whether there is one depends on the data


def test_without_the_library_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "arro3", None)
    with pytest.raises(MissingExtraError) as error:
        write_parquet(rows(), tmp_path / "x", RECIPE, host_time=False)
    expected = (
        "A Parquet file needs the package arro3-io, which is not installed: pip install 'gatewayd[parquet]'"
    )
    assert str(error.value) == expected


def test_an_interrupt_while_the_file_is_written_stays_one() -> None:
    """It comes wherever Python runs, and the library would report it as a file that cannot be written."""

    class Interrupted(BytesIO):
        def write(self, _data: Any) -> int:
            raise KeyboardInterrupt

    failures: list[BaseException] = []
    output = _Output(Interrupted(), failures)
    assert (output.write(b"12"), output.write(b"345")) == (2, 3)
    assert [type(failure) for failure in failures] == [KeyboardInterrupt]
