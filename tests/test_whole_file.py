"""Files that are there whole or not at all, in real folders."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from gatewayd.whole_file import whole_file


def put(path: Path, text: str, *, overwrite: bool = True) -> None:
    with whole_file(path, overwrite=overwrite) as unfinished:
        unfinished.write_text(text)


def fail(path: Path, error: BaseException) -> None:
    with whole_file(path, overwrite=True) as unfinished:
        unfinished.write_text("half")
        raise error


def put_late(path: Path) -> None:
    with whole_file(path, overwrite=False) as unfinished:
        unfinished.write_text("ours")
        path.write_text("theirs")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_the_name_is_given_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "x"
    with whole_file(path, overwrite=False) as unfinished:
        unfinished.write_text("half")
        assert not path.exists()
        assert unfinished.parent == tmp_path
        unfinished.write_text("whole")
    assert path.read_text() == "whole"
    assert names(tmp_path) == ["x"]


@pytest.mark.parametrize("error", [ValueError(), KeyboardInterrupt()])
def test_what_fails_leaves_the_former_file_and_nothing_else(tmp_path: Path, error: BaseException) -> None:
    (tmp_path / "x").write_text("former")
    with pytest.raises(type(error)):
        fail(tmp_path / "x", error)
    with pytest.raises(FileNotFoundError), whole_file(tmp_path / "x", overwrite=True):
        pass  # nothing is written
    assert (tmp_path / "x").read_text() == "former"
    assert names(tmp_path) == ["x"]


def test_a_file_that_came_meanwhile_is_not_overwritten_unasked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_links(_self: Path, _target: Path) -> None:
        raise OSError(errno.EPERM, "no links here")

    for _ in range(2):
        (tmp_path / "x").unlink(missing_ok=True)
        with pytest.raises(FileExistsError):
            put_late(tmp_path / "x")
        monkeypatch.setattr(Path, "hardlink_to", no_links)
    put(tmp_path / "y", "ours", overwrite=False)
    assert (tmp_path / "x").read_text() == "theirs"
    assert names(tmp_path) == ["x", "y"]


def test_permissions_and_links_stay(tmp_path: Path) -> None:
    (tmp_path / "real").write_text("former")
    (tmp_path / "real").chmod(0o600)
    (tmp_path / "link").symlink_to("real")
    put(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"
    assert (tmp_path / "real").stat().st_mode & 0o777 == 0o600


def test_what_is_no_regular_file_is_written_to_as_it_is(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    put(tmp_path / "pipe", "through")
    assert os.read(reader, 100) == b"through"
    os.close(reader)
    assert names(tmp_path) == ["pipe"]
    with pytest.raises(IsADirectoryError):
        put(tmp_path, "x")


def test_a_name_may_be_as_long_as_names_can_be(tmp_path: Path) -> None:
    put(tmp_path / ("ü" * 127), "whole")
    assert names(tmp_path) == ["ü" * 127]
