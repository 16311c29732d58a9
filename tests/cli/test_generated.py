"""Generated files beside what people made of them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from gatewayd.cli.generated import planned, write
from gatewayd.links.exports import CHECKSUM, ExportedFile

PART = ExportedFile("part.st", f"(* {CHECKSUM} *)\nx := 1;\n", line_end="\r\n")
MAIN = ExportedFile("main.st", "y := 1;\n", once=True)
RENEWED = ExportedFile("part.st", f"(* {CHECKSUM} *)\nx := 2;\n", line_end="\r\n")


def export(folder: Path, *files: ExportedFile, force: bool = False) -> list[str]:
    found = planned(folder, files, force=force)
    write(found)
    return [file.state for file in found]


def test_first_and_second_time(tmp_path: Path) -> None:
    """The folder is made; what is the same is left as it is."""
    folder = tmp_path / "new"
    assert export(folder, PART, MAIN) == ["new", "new"]
    assert export(folder, PART, MAIN) == ["the same", "the same"]
    assert export(folder, RENEWED, MAIN) == ["renewed", "the same"]
    assert b"x := 2;\r\n" in (folder / "part.st").read_bytes()
    assert sorted(path.name for path in folder.iterdir()) == ["main.st", "part.st"]


def test_a_changed_file_is_left_alone(tmp_path: Path) -> None:
    export(tmp_path, PART)
    changed = (tmp_path / "part.st").read_bytes().replace(b"1", b"3")
    (tmp_path / "part.st").write_bytes(changed)
    assert export(tmp_path, RENEWED) == ["changed by hand"]
    assert (tmp_path / "part.st").read_bytes() == changed
    assert export(tmp_path, RENEWED, force=True) == ["renewed"]


def test_the_users_own_file_is_never_overwritten(tmp_path: Path) -> None:
    export(tmp_path, MAIN)
    (tmp_path / "main.st").write_text("mine")
    assert export(tmp_path, MAIN, force=True) == ["yours, left alone"]
    assert (tmp_path / "main.st").read_text() == "mine"


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_line_ends_and_marks_of_editors_are_no_change(tmp_path: Path, line_end: str) -> None:
    export(tmp_path, PART)
    text = (tmp_path / "part.st").read_text(encoding="utf-8")
    (tmp_path / "part.st").write_text("\ufeff" + text, encoding="utf-8", newline=line_end)
    assert export(tmp_path, RENEWED) == ["renewed"]


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"gatewayd-checksum: zz", b"\x00" * 100])
def test_what_is_no_file_of_ours_is_left_alone(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "part.st").write_bytes(content)
    assert export(tmp_path, PART) == ["changed by hand"]


def test_a_folder_in_the_way_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "part.st").mkdir()
    with pytest.raises(OSError, match="directory"):
        planned(tmp_path, [PART], force=False)


def test_a_pipe_in_the_way_is_an_error_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "part.st")
    with pytest.raises(OSError, match="not a regular file"):
        planned(tmp_path, [PART], force=True)


def test_what_cannot_be_put_there_leaves_nothing_behind(tmp_path: Path) -> None:
    found = planned(tmp_path, [PART], force=False)
    (tmp_path / "part.st").mkdir()
    with pytest.raises(OSError, match="directory"):
        write(found)
    assert [path.name for path in tmp_path.iterdir()] == ["part.st"]
