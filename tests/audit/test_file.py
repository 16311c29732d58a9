"""The audit's file under everything a disk can do; the gateway's own thread never notices."""

from __future__ import annotations

import json
import logging
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gatewayd.audit import file as auditfile
from gatewayd.audit.file import HANGS, AuditFile
from gatewayd.loop import clock

Opened = Callable[..., AuditFile]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Opened]:
    files: list[AuditFile] = []

    def make(path: Path | None = None, limit: int = 1000, kept: int = 2) -> AuditFile:
        files.append(AuditFile(path or tmp_path / "audit.jsonl", limit, kept, retry=0.02))
        return files[-1]

    yield make
    for one in files:
        one.close()


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def text(path: Path) -> str:
    return path.read_text() if path.exists() else ""


def test_lines_are_appended_to_what_is_there(opened: Opened, tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    path.write_text("before\n")
    one = opened(path)
    one.put("now")
    one.close()
    assert path.read_text() == "before\nnow\n"
    assert path.stat().st_mode & 0o777 == 0o644


def test_a_new_file_is_not_for_everybody(opened: Opened) -> None:
    one = opened()
    one.put("x")
    one.close()
    assert one.path.stat().st_mode & 0o007 == 0


def test_it_is_rotated_by_size_and_the_oldest_goes(opened: Opened, tmp_path: Path) -> None:
    one = opened()
    for number in range(5):
        one.put(f"{number} " + "x" * 1200)
        until(lambda number=number: f"{number} x" in text(one.path))  # type: ignore[misc]
    one.close()
    found = {path.name: path.read_text()[0] for path in tmp_path.iterdir()}
    assert found == {"audit.jsonl": "4", "audit.jsonl.1": "3", "audit.jsonl.2": "2"}


def test_trouble_is_told_before_anybody_writes(opened: Opened, tmp_path: Path) -> None:
    one = opened(tmp_path / "missing" / "audit.jsonl")
    until(lambda: "No such file" in one.trouble(clock.now()))
    (tmp_path / "missing").mkdir()
    until(lambda: not one.trouble(clock.now()))
    assert one.path.read_bytes() == b""


@pytest.mark.parametrize("by", ["delete", "move"])
def test_a_file_that_vanished_is_begun_anew(opened: Opened, tmp_path: Path, by: str) -> None:
    one = opened()
    one.put("first")
    until(lambda: "first" in text(one.path))
    if by == "delete":
        one.path.unlink()
    else:
        one.path.rename(tmp_path / "moved")
    one.put("second")
    until(lambda: "second" in text(one.path))
    assert one.path.read_text() == "second\n"


def test_a_full_disk_is_told_once_and_costs_nothing(opened: Opened, caplog: pytest.LogCaptureFixture) -> None:
    if not os.path.exists("/dev/full"):  # noqa: PTH110
        pytest.skip("no /dev/full")
    one = opened(Path("/dev/full"))
    one.put("x")
    until(lambda: bool(one.trouble(clock.now())))
    begun = time.perf_counter()
    for _ in range(1000):
        one.put("y")
    assert time.perf_counter() - begun < 1.0
    time.sleep(0.1)
    reported = [record for record in caplog.records if record.levelno == logging.ERROR]
    assert [record.__dict__["fields"]["reason"] for record in reported] == ["No space left on device"]


def test_it_goes_on_when_the_directory_comes_and_counts_what_was_lost(
    opened: Opened, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(auditfile, "QUEUE", 3)
    one = opened(tmp_path / "missing" / "audit.jsonl", limit=10**6)
    for number in range(10):
        one.put(str(number))
    until(lambda: bool(one.trouble(clock.now())))
    assert one.dropped == 7
    one.path.parent.mkdir()
    until(lambda: "dropped" in text(one.path))
    *kept, lost = one.path.read_text().splitlines()
    assert kept == ["0", "1", "2"]
    assert json.loads(lost) == {"what": "records dropped", "times": 7}
    until(lambda: not one.trouble(clock.now()))


@pytest.fixture
def hung(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """A disk whose writes take until the event is set."""
    go, write = threading.Event(), os.write

    def wait(descriptor: int, data: bytes) -> int:
        if threading.current_thread().name == "audit file":
            assert go.wait(10)
        return write(descriptor, data)

    monkeypatch.setattr(auditfile.os, "write", wait)  # type: ignore[attr-defined]
    yield go
    go.set()


def test_closing_takes_no_longer_than_its_patience(opened: Opened, hung: threading.Event) -> None:
    """A disk that hangs does not hang the gateway's end."""
    one = opened()
    one.put("x")
    begun = time.monotonic()
    one.close(0.1)
    assert time.monotonic() - begun < 5.0
    hung.set()


def test_a_disk_that_hangs_is_a_trouble_and_told_once(
    opened: Opened, hung: threading.Event, caplog: pytest.LogCaptureFixture
) -> None:
    one = opened()
    one.put("x")
    until(lambda: one.held_up(clock.now()) > 0)
    assert one.trouble(clock.now()) == ""
    for later in (HANGS, HANGS + 1, HANGS + 2):
        one.look(clock.now() + later)
    assert one.trouble(clock.now() + HANGS) == "it has taken nothing for more than 5 s"
    reported = [record.__dict__["fields"]["reason"] for record in caplog.records]
    assert reported == ["it has taken nothing for more than 5 s"]
    hung.set()
    until(lambda: text(one.path) == "x\n" and one.held_up(clock.now()) == 0)
    assert one.trouble(clock.now() + 2 * HANGS) == ""


def test_records_that_are_lost_are_a_trouble(
    opened: Opened, hung: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(auditfile, "QUEUE", 3)
    one = opened()
    for number in range(5):
        one.put(str(number))
    assert one.trouble(clock.now()) == "records are lost, they come faster than it takes them"
    hung.set()
    until(lambda: '"times": 2' in text(one.path) and not one.trouble(clock.now()))


def test_a_pipe_is_no_file(opened: Opened, tmp_path: Path) -> None:
    """Whoever reads it may be gone, and what was in it with him."""
    os.mkfifo(tmp_path / "pipe")
    for readers in ((), (os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK),)):
        one = opened(tmp_path / "pipe")
        one.put("x")
        until(lambda one=one: one.trouble(clock.now()) == "it is a pipe, which keeps nothing: name a file")  # type: ignore[misc]
        one.close()
        for reader in readers:
            assert os.read(reader, 10) == b""
            os.close(reader)
