"""Text as others write it."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.rtde.recording import RecordingError, open_recording
from tests.rtde.recording.samples import HEADER, LINES, PACKAGES


def read(path: Path, text: str) -> list[tuple[bool | int | float, ...]]:
    path.write_bytes(text.encode())
    with open_recording(path) as found:
        return list(found)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r\r\n"),
        lambda text: text.replace("\n", "\n\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace(" 1\n", " True\n").replace(" 0\n", " False\n"),
        lambda text: text.replace(" 7 ", " [7] ").replace(" 255 ", " [255] "),
        lambda text: text.replace(" 7 ", " 7.0 ").replace(" 1\n", " 1.0\n"),
        lambda text: text.replace(" ", ","),
        lambda text: "\n".join('"' + line.replace(" ", '";"') + '"' for line in text.splitlines()) + "\n",
    ],
    ids=["ours", "official", "official on Windows", "empty", "BOM", "True", "[7]", "7.0", "commas", "quoted"],
)
def test_whoever_wrote_it(tmp_path: Path, change: object) -> None:
    assert callable(change)
    text = "".join(f"{line}\n" for line in (HEADER, *LINES))
    assert repr(read(tmp_path / "x", change(text))) == repr(list(PACKAGES))


@pytest.mark.parametrize(
    "text, message",
    [
        ("a b\n1 2\n1\n", "3: 1 column, where the first line has 2"),
        ('a b\n1\r"2\n', "2: the line cannot be split into columns; is it a recording of RTDE?"),
        ("a b\n1 2 3\n", "2: 3 columns, where the first line has 2"),
        ("a;b\n1;0,5\n", "2: '0,5' in column b is no DOUBLE; correct the cell, or leave out the line"),
        ("a b\n1 \n", "2: '' in column b is no DOUBLE; correct the cell, or leave out the line"),
        (
            "robot_mode\n7.5\n",
            "2: '7.5' in column robot_mode is no INT32; correct the cell, or leave out the line",
        ),
        (
            "robot_mode\n1e999\n",
            "2: '1e999' in column robot_mode is no INT32; correct the cell, or leave out the line",
        ),
        (
            "output_bit_register_64\n2\n",
            "2: '2' in column output_bit_register_64 is no BOOL; correct the cell, or leave out the line",
        ),
        (
            "robot_mode\n9999999999\n",
            "2: robot_mode is INT32 and cannot hold 9999999999; is it a recording of RTDE?",
        ),
    ],
)
def test_what_cannot_be_read_has_its_line_its_value_and_a_remedy(
    tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "x.csv"
    with pytest.raises(RecordingError) as error:
        read(path, text)
    assert str(error.value) == f"{path}:{message}"


def test_a_line_without_end_is_not_gathered_in_memory(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    with pytest.raises(RecordingError, match="2: the line has no end"):
        read(path, "a\n" + "1" * (1 << 21))


def test_the_torn_line_is_named(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("a b\n1 2\n3 4")
    with open_recording(path) as found:
        assert list(found) == [(1.0, 2.0)]
        assert found.torn == f"{path}:3: the last line is not whole and was left out"
