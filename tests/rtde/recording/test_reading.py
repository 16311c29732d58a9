"""Recordings are read as they were written, and hostile files are refused."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.recording import RecordingError, create_recording, open_recording
from tests.rtde.recording.samples import HEADER, LINES, PACKAGES, RECIPE, TYPES, packages_of, recipes


@given(st.data(), st.booleans(), st.sampled_from(" ,;\t"), st.booleans())
def test_what_is_written_is_read(data: st.DataObject, binary: bool, delimiter: str, host_time: bool) -> None:
    recipe = data.draw(recipes())
    packages = data.draw(st.lists(st.tuples(packages_of(recipe), st.floats(allow_nan=False)), max_size=5))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x"
        with create_recording(
            path, recipe, binary=binary, delimiter=delimiter, host_time=host_time
        ) as written:
            for values, time in packages:
                written.write(values, time)
        given_delimiter = delimiter if recipe.count == 1 and not host_time else None
        with open_recording(path, delimiter=given_delimiter) as found:
            assert (found.recipe.names, found.recipe.types, found.host_time) == (
                recipe.names,
                recipe.types,
                host_time,
            )
            rows = list(found.rows())
            assert repr(rows) == repr([(values, time if host_time else None) for values, time in packages])
            assert (found.torn, found.position, found.total) == ("", path.stat().st_size, path.stat().st_size)


@pytest.mark.parametrize("binary", [False, True])
def test_a_recording_is_read_again_from_its_begin(tmp_path: Path, binary: bool) -> None:
    path = tmp_path / "x"
    with create_recording(path, RECIPE, binary=binary) as written:
        for values in PACKAGES:
            written.write(values)
    with open_recording(path) as found:
        assert next(iter(found)) == PACKAGES[0]
        assert list(found) == list(PACKAGES)
        assert list(found) == list(PACKAGES)


@pytest.mark.parametrize("binary", [False, True])
def test_a_last_package_that_is_cut_off_is_left_out_and_reported(tmp_path: Path, binary: bool) -> None:
    path = tmp_path / "x"
    with create_recording(path, RECIPE, binary=binary) as written:
        for values in PACKAGES:
            written.write(values)
    whole = path.read_bytes()
    size = RECIPE.size if binary else len(LINES[1]) + 1
    for cut in range(1, size):
        path.write_bytes(whole[:-cut])
        with open_recording(path) as found:
            assert list(found) == [PACKAGES[0]]
            assert found.torn.endswith("left out")


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_text_of_two_bytes_a_character_is_no_recording(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text("\n".join((HEADER, *LINES)), encoding=encoding)
    with pytest.raises(RecordingError, match=r"x\.csv:1: no recording: it is UTF-16, .*; save it as UTF-8"):
        open_recording(path)


def test_a_recording_of_one_column_is_of_text_whatever_its_first_cell(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("timestamp\n0.5\n")
    with open_recording(path) as found:
        assert list(found) == [(0.5,)]


@pytest.mark.parametrize(
    "content, message",
    [
        (b"", ":1: no recording: it has no line with the names of its columns"),
        (b"timestamp", ":1: no recording: it has no line with the names of its columns"),
        (b"a b a\n1 2 3\n", ":1: no recording: the column a is there twice"),
        (b"a a\nDOUBLE DOUBLE\n", ":1: no recording: the column a is there twice"),
    ],
)
def test_files_that_are_none(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "x"
    path.write_bytes(content)
    with pytest.raises(RecordingError) as error:
        open_recording(path)
    assert str(error.value) == f"{path}{message}"


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    for path in (tmp_path / "x", tmp_path):
        with pytest.raises(RecordingError, match="cannot be read: "):
            open_recording(path)


_PIECES = st.sampled_from(
    [
        *(line.encode() + b"\n" for line in (HEADER, TYPES, *LINES)),
        *(
            b"timestamp host_time\n",
            b"DOUBLE DOUBLE\n",
            b"1 2\n",
            b"\n",
            b"\r\n",
            b"\0",
            b"\xff",
            b'"',
            b"nan inf\n",
        ),
        RECIPE.pack(PACKAGES[0]),
    ]
)


@given(st.one_of(st.binary(max_size=300), st.lists(_PIECES, max_size=8).map(b"".join)))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x"
        path.write_bytes(data)
        for recipe, values in _read(path):
            recipe.pack(values)


def _read(path: Path) -> Iterator[tuple[Recipe, tuple[Scalar, ...]]]:
    """The packages up to what cannot be read."""
    try:
        with open_recording(path) as recording:
            for values in recording:
                yield recording.recipe, values
    except RecordingError as error:
        assert str(error).startswith(f"{path}:")  # noqa: PT017 - whether there is one depends on the data
