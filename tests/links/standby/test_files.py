"""The files that keepalived follows."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

import pytest

from gatewayd.links.standby.files import RETRY_PERIOD, TOUCH_PERIOD, StandbyFiles, directory_of


def is_locked(path: Path) -> bool:
    with path.open() as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        return False


def test_zero_is_for_the_one_that_may_have_the_address(tmp_path: Path) -> None:
    files = StandbyFiles(tmp_path / "run", "press-3")
    files.update(100.0, eligible=False)
    assert files.path == tmp_path / "run" / "standby-press-3"
    assert files.path.read_text() == "1\n"
    files.update(100.1, eligible=True)
    assert files.path.read_text() == "0\n"
    assert is_locked(files.alive)
    files.close()
    assert files.path.read_text() == "1\n"
    assert not is_locked(files.alive)


def test_a_file_is_written_when_it_changes_and_in_place(tmp_path: Path) -> None:
    files = StandbyFiles(tmp_path, "press-3")
    files.update(100.0, eligible=True)
    before = files.path.stat()
    files.update(100.1, eligible=True)
    assert files.path.stat().st_mtime_ns == before.st_mtime_ns
    files.update(100.2, eligible=False)
    assert files.path.stat().st_ino == before.st_ino


def test_the_other_one_is_touched_as_long_as_it_works(tmp_path: Path) -> None:
    files = StandbyFiles(tmp_path, "press-3")
    files.update(100.0, eligible=True)
    os.utime(files.alive, (1, 1))
    files.update(100.0 + TOUCH_PERIOD / 2, eligible=True)
    assert files.alive.stat().st_mtime == 1
    files.update(100.0 + TOUCH_PERIOD, eligible=True)
    assert files.alive.stat().st_mtime > 1


def test_trouble_is_said_once_and_passes(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "run").write_text("in the way")
    files = StandbyFiles(tmp_path / "run", "press-3")
    files.update(100.0, eligible=True)
    files.update(100.1, eligible=True)
    files.update(100.0 + RETRY_PERIOD, eligible=True)
    assert files.trouble
    assert len(caplog.records) == 1
    (tmp_path / "run").unlink()
    files.update(100.0 + 2 * RETRY_PERIOD, eligible=True)
    assert (files.trouble, files.path.read_text()) == ("", "0\n")


def test_two_gateways_on_one_machine_do_not_share_the_file(tmp_path: Path) -> None:
    first, second = StandbyFiles(tmp_path, "press-3"), StandbyFiles(tmp_path, "press-3")
    first.update(100.0, eligible=True)
    second.update(100.0, eligible=True)
    assert second.trouble == "another gateway on this machine has the cell"


def test_directory(tmp_path: Path) -> None:
    assert directory_of({"RUNTIME_DIRECTORY": "/run/gatewayd:/run/other"}, tmp_path) == Path("/run/gatewayd")
    assert directory_of({}, tmp_path) == tmp_path
