"""`gatewayd run` at its edges: exit codes, formats, and a file that is no file. The running daemon: tests/e2e."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]

BROKEN = "gatewayd: 1\ncell: [\n"


@pytest.fixture
def run() -> Run:
    """`gatewayd run ARGS`, which has to end by itself."""

    def start(*args: str | Path) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "gatewayd", "run", *map(str, args)]
        return subprocess.run(command, capture_output=True, text=True, check=False, timeout=30)

    return start


def test_help_teaches_examples_and_exit_codes(run: Run) -> None:
    done = run("--help")
    assert done.returncode == 0
    for words in ("Examples:", "gatewayd run my-cell.yaml", "Exit codes:", "130", "--log-format"):
        assert words in done.stdout


def test_no_file_is_wrong_usage(run: Run) -> None:
    done = run()
    assert done.returncode == 2
    assert "FILES" in done.stderr


def test_a_token_without_a_listener_is_wrong_usage(run: Run, tmp_path: Path) -> None:
    """Silently ignored, it would be taken for a protection."""
    done = run("--token-file", tmp_path / "token", tmp_path / "cell.yaml")
    assert done.returncode == 2
    assert "add --status 127.0.0.1:9502" in done.stderr


@pytest.mark.parametrize(
    "contents, code",
    [(None, 2), (BROKEN, 1), ("", 1), ("\x00", 1)],
    ids=["missing", "broken", "empty", "binary"],
)
def test_nothing_that_can_be_served(run: Run, tmp_path: Path, contents: str | None, code: int) -> None:
    path = tmp_path / "cell.yaml"
    if contents is not None:
        path.write_text(contents)
    done = run(path)
    assert done.returncode == code
    assert str(path) in done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr


def test_json_is_one_object_per_line(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text(BROKEN)
    done = run("--log-format", "json", path)
    events = [json.loads(line) for line in done.stderr.splitlines()]
    assert events[-1]["event"] == "the cell is not served"
    assert events[-1]["level"] == "error"


def test_the_journal_gets_priorities(run: Run, tmp_path: Path) -> None:
    done = run("--log-format", "journal", tmp_path / "cell.yaml")
    assert done.stderr.startswith("<3>cannot read the mapping file ")


def test_an_endless_device_does_not_fill_the_memory(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    path.symlink_to("/dev/zero")
    done = run(path)
    assert done.returncode == 1
    assert str(path) in done.stderr
