"""Closed, full and ASCII-only streams, with the command as a process: one line, an exit code, no internal error."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gatewayd.service.standard_streams import ESCAPES, prepare

ROOT = Path(__file__).parents[2]
MAPPING = "mappings/two-plcs.yaml"
BROKEN = "gatewayd/links/modbus_server/rules/GW214-register-overlap/bad.yaml"
COMMANDS = [
    ("--help",),
    ("show", "--help"),
    ("show", MAPPING),
    ("show", "--format", "json", MAPPING),
    ("check", MAPPING),
    ("check", BROKEN),
    ("diff", MAPPING, "mappings/two-buses.yaml"),
    ("export", "eds", "mappings/two-buses.yaml"),
    ("completion", "bash"),
]
DEGREES = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.9}
modbus: {listen: '127.0.0.1:1502'}
variables:
  heat: {robot: output_double_register_0, unit: '\u00b0C', modbus: {holding: 0, type: float32},
         comment: '\U0001f525 w\u00e4rme'}
"""


def shell(redirected: str, *command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", f'"$@" {redirected}', "bash", sys.executable, "-m", "gatewayd", *command],
        capture_output=True,
        encoding="utf-8",
        check=False,
        timeout=60,
        cwd=ROOT,
        env=os.environ | environment,
    )


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
@pytest.mark.parametrize(
    "redirected, reason", [(">/dev/full", "No space left on device"), (">&-", "Bad file descriptor")]
)
def test_an_output_that_takes_nothing_is_one_line(
    command: tuple[str, ...], redirected: str, reason: str
) -> None:
    done = shell(redirected, *command)
    lines = done.stderr.splitlines()
    assert (done.returncode, lines[-1]) == (1, f"gatewayd: cannot write the output: {reason}")
    assert "internal error" not in done.stderr
    assert len(lines) == 1 or "check" in command


@pytest.mark.parametrize("redirected", ["2>&-", "2>/dev/full"])
@pytest.mark.parametrize(
    "command, code", [(("show", MAPPING), 0), (("show", BROKEN), 1), (("no-such-command",), 2)]
)
def test_errors_that_cannot_be_written_change_no_exit_code(
    redirected: str, command: tuple[str, ...], code: int
) -> None:
    assert shell(redirected, *command).returncode == code


def test_with_all_streams_closed_nothing_else_gets_their_numbers() -> None:
    assert shell("<&- >&- 2>&-", "show", MAPPING).returncode == 1


def test_a_reader_that_leaves_after_a_line_hears_nothing_more() -> None:
    done = shell("| head -1", "show", "--format", "csv", MAPPING)
    assert (len(done.stdout.splitlines()), done.stderr) == (1, "")


@pytest.mark.parametrize("form", ["table", "csv", "json", "markdown"])
def test_a_terminal_of_ascii_gets_escapes(form: str, tmp_path: Path) -> None:
    file = tmp_path / "heat.yaml"
    file.write_text(DEGREES, encoding="utf-8")
    done = shell(
        "", "show", "--format", form, str(file), LC_ALL="C", PYTHONIOENCODING="ascii", PYTHONUTF8="0"
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.isascii()
    assert "\\u00b0C" in done.stdout
    if form == "json":
        found = json.loads(done.stdout)["variables"][0]
        assert (found["unit"], found["comment"]) == ("\u00b0C", "\U0001f525 w\u00e4rme")


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_every_command_speaks_ascii(command: tuple[str, ...]) -> None:
    done = shell("", *command, LC_ALL="C", PYTHONIOENCODING="ascii", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0")
    assert "internal error" not in done.stderr
    assert (done.stdout + done.stderr).isascii()


def test_signs_of_our_own_become_one_character() -> None:
    prepare_once()
    assert "a\u2026 \u2192 \u25cf".encode("ascii", ESCAPES) == b"a~ > *"


def prepare_once() -> None:
    """The error handler alone: the streams of the test runner are its own."""
    streams = sys.stdin, sys.stdout, sys.stderr
    prepare()
    sys.stdin, sys.stdout, sys.stderr = streams


@pytest.mark.parametrize("redirected", [">/dev/full", ">&-", ">/dev/full 2>&1"])
@pytest.mark.parametrize("command", [("demo", "--seconds", "20"), ("simulate", "--quiet")], ids=" ".join)
def test_what_would_run_on_unseen_ends(redirected: str, command: tuple[str, ...]) -> None:
    done = shell(redirected, *command, "--port", "0")
    assert done.returncode == 1
    assert "internal error" not in done.stderr
    assert len(done.stderr.splitlines()) == (0 if "2>" in redirected else 1)
