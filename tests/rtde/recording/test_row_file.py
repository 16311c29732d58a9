"""A file that ends with a whole row at any moment."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from gatewayd.rtde.recording.errors import RecordingError
from gatewayd.rtde.recording.row_file import RowFile


def test_rows_wait_for_each_other_and_for_nothing_longer_than_the_end(tmp_path: Path) -> None:
    path = tmp_path / "x"
    file = RowFile(path, b"head\n", flush_every=3)
    seen = []
    for number in range(4):
        file.append(b"%d\n" % number)
        seen.append((path.read_bytes(), file.rows, file.size))
    assert seen == [
        (b"head\n", 0, 5),
        (b"head\n", 0, 5),
        (b"head\n0\n1\n2\n", 3, 11),
        (b"head\n0\n1\n2\n", 3, 11),
    ]
    file.flush()
    assert path.read_bytes() == b"head\n0\n1\n2\n3\n"
    file.append(b"4\n")
    file.close()
    file.close()
    assert path.read_bytes() == b"head\n0\n1\n2\n3\n4\n"


def test_a_write_that_was_interrupted_is_written_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C after half of the bytes: the next flush writes all of them at the same place."""
    path = tmp_path / "x"
    file = RowFile(path, b"head\n", flush_every=10)
    file.append(b"first\n")
    file.append(b"second\n")
    write = os.pwrite

    def interrupted(descriptor: int, data: bytes, place: int) -> int:
        write(descriptor, data[:3], place)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "pwrite", interrupted)
    with pytest.raises(KeyboardInterrupt):
        file.flush()
    monkeypatch.setattr(os, "pwrite", write)
    file.close()
    assert path.read_bytes() == b"head\nfirst\nsecond\n"
    assert file.rows == 2


@pytest.mark.parametrize(
    "room, kept", [(0, b""), (5, b""), (6, b"first\n"), (12, b"first\n"), (13, b"first\nsecond\n")]
)
def test_what_found_room_is_kept_row_by_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: int, kept: bytes
) -> None:
    path = tmp_path / "x"
    file = RowFile(path, b"head\n", flush_every=10)
    for row in (b"first\n", b"second\n", b"third\n"):
        file.append(row)
    write = os.pwrite

    def full(descriptor: int, data: bytes, place: int) -> int:
        fitting = data[: max(0, room + 5 - place)]
        if not fitting:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(descriptor, fitting, place)

    monkeypatch.setattr(os, "pwrite", full)
    with pytest.raises(RecordingError) as error:
        file.flush()
    rows = {0: "no rows", 1: "1 row", 2: "2 rows"}[kept.count(b"\n")]
    assert str(error.value) == f"{path}: No space left on device; the file has {rows}, all of them whole"
    assert path.read_bytes() == b"head\n" + kept
    with pytest.raises(RecordingError, match="No space left"):
        file.append(b"fourth\n")
    file.close()
    assert path.read_bytes() == b"head\n" + kept


def test_what_the_system_reports_at_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(_descriptor: int) -> None:
        raise OSError(errno.EDQUOT, "Disk quota exceeded")

    file = RowFile(tmp_path / "x", b"head\n")
    monkeypatch.setattr(os, "fsync", refused)
    with pytest.raises(RecordingError, match="may lack its end: Disk quota exceeded"):
        file.close()


@pytest.mark.parametrize("overwrite", [False, True])
def test_nobody_overwrites_what_is_being_written(tmp_path: Path, overwrite: bool) -> None:
    """Neither a second recording with --force, which would spoil both; when the first is closed it may."""
    path = tmp_path / "x"
    path.write_bytes(b"former, and longer than what comes\n")
    if not overwrite:
        path.unlink()
    first = RowFile(path, b"head\n", overwrite=overwrite)
    first.append(b"1\n")
    with pytest.raises(RecordingError, match="another recording is writing it; choose another name"):
        RowFile(path, b"other\n", overwrite=True)
    first.append(b"2\n")
    first.close()
    assert path.read_bytes() == b"head\n1\n2\n"
    RowFile(path, b"other\n", overwrite=True).close()
    assert path.read_bytes() == b"other\n"


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    """Rows are written at their places, which a pipe does not have; without a reader it could not even be opened."""
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(RecordingError, match="cannot be written"):
        RowFile(path, b"head\n", overwrite=True)


def test_a_device_is_taken_as_it_is() -> None:
    RowFile("/dev/null", b"head\n", overwrite=True).close()
    RowFile("/dev/null", b"head\n", overwrite=True).close()
