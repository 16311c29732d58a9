"""Finished recordings from one format to another."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import pytest

from gatewayd.rtde.recording import (
    GapWriter,
    RecordedGap,
    RecordingError,
    RecordingExistsError,
    RecordingFormat,
    RecordingReader,
    convert,
    create_recording,
    open_recording,
    read_gaps,
)
from tests.rtde.recording.samples import PACKAGES, RECIPE

GAP = RecordedGap(1, "skipped", 3, 1.0, 1.008, 17.5)


def recorded(path: Path, packages: int = 2) -> Path:
    with create_recording(path, RECIPE, binary=path.suffix == ".bin", host_time=True) as recording:
        for number in range(packages):
            recording.write(PACKAGES[number % 2], 17.5)
    with GapWriter(path) as gaps:
        gaps.write(GAP)
    return path


def rows(path: Path) -> list[tuple[tuple[bool | int | float, ...], float | None]]:
    with open_recording(path) as recording:
        return list(recording.rows())


@pytest.mark.parametrize(
    "forms", list(permutations(RecordingFormat)), ids=lambda forms: "-".join(form.word for form in forms)
)
def test_through_all_formats_and_back_nothing_is_lost(
    tmp_path: Path, forms: tuple[RecordingFormat, ...]
) -> None:
    path = recorded(tmp_path / "x.csv", 1000)
    first = path
    for number, form in enumerate(forms):
        target = tmp_path / f"{number}{form.endings[0]}"
        assert convert(path, target, form) == (1000, "")
        assert read_gaps(target) == (GAP,)
        path = target
    assert repr(rows(path)) == repr(rows(first))
    assert sorted(tmp_path.glob("*.part")) == []


def test_delimiters_of_both_sides(tmp_path: Path) -> None:
    (tmp_path / "x").write_text("a:b\n1:2\n")
    convert(tmp_path / "x", tmp_path / "y", RecordingFormat.CSV, delimiters=(":", "\t"))
    assert (tmp_path / "y").read_text() == "a\tb\n1.0\t2.0\n"


def test_a_file_that_is_there_is_overwritten_only_on_request(tmp_path: Path) -> None:
    source, target = recorded(tmp_path / "x.csv"), tmp_path / "y.csv"
    target.write_text("precious")
    with pytest.raises(RecordingExistsError):
        convert(source, target, RecordingFormat.CSV)
    assert target.read_text() == "precious"
    convert(source, target, RecordingFormat.CSV, overwrite=True)
    assert rows(target) == rows(source)


def test_the_gaps_of_another_recording_are_in_the_way_from_the_begin(tmp_path: Path) -> None:
    source = recorded(tmp_path / "x.csv")
    (tmp_path / "y.csv.gaps.jsonl").write_text("precious")
    with pytest.raises(RecordingExistsError, match=r"y\.csv\.gaps\.jsonl"):
        convert(source, tmp_path / "y.csv", RecordingFormat.CSV)
    assert sorted(path.name for path in tmp_path.glob("y*")) == ["y.csv.gaps.jsonl"]


def test_a_file_that_comes_in_the_meantime_stays(tmp_path: Path) -> None:
    source, target = recorded(tmp_path / "x.csv", 1000), tmp_path / "y.csv"

    def meddle(_recording: RecordingReader, _packages: int) -> None:
        target.write_text("precious")

    with pytest.raises(RecordingExistsError):
        convert(source, target, RecordingFormat.CSV, progress=meddle)
    assert target.read_text() == "precious"
    assert sorted(tmp_path.glob("*.part")) == []


def test_a_recording_is_not_converted_to_itself(tmp_path: Path) -> None:
    source = recorded(tmp_path / "x.csv")
    (tmp_path / "link").symlink_to(source)
    with pytest.raises(RecordingError, match="is the recording itself"):
        convert(source, tmp_path / "link", RecordingFormat.CSV, overwrite=True)
    assert len(rows(source)) == 2


@pytest.mark.parametrize("form", list(RecordingFormat))
def test_a_line_that_cannot_be_read_leaves_no_file(tmp_path: Path, form: RecordingFormat) -> None:
    source = tmp_path / "x.csv"
    source.write_text("a\n" + "1\n" * 600 + "x\n")
    with pytest.raises(RecordingError, match=r"x\.csv:602: 'x' in column a is no DOUBLE"):
        convert(source, tmp_path / "y", form)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.csv"]


def test_what_was_left_out_is_reported(tmp_path: Path) -> None:
    source = tmp_path / "x.csv"
    source.write_text("a\n1\n2")
    assert convert(source, tmp_path / "y", RecordingFormat.CSV) == (
        1,
        f"{source}:3: the last line is not whole and was left out",
    )


@pytest.mark.parametrize(
    "name, form",
    [
        ("a.csv", RecordingFormat.CSV),
        ("a.TXT", RecordingFormat.CSV),
        ("a.bin", RecordingFormat.BINARY),
        ("a.csv.parquet", RecordingFormat.PARQUET),
        ("a", None),
        ("csv", None),
    ],
)
def test_names_stand_for_formats(name: str, form: RecordingFormat | None) -> None:
    assert RecordingFormat.of_name(name) is form
