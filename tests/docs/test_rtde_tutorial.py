"""The fifth step of the tutorial, as a reader does it, with a simulated robot in another process."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.docs.generated import DOCS
from tests.docs.test_commands import commands

PATIENCE = 60.0
STRANGE_GATEWAY = "which robot it serves is not known"
PAGE = DOCS / "tutorial" / "5-rtde.md"


@pytest.fixture
def robot() -> Iterator[str]:
    """`HOST:PORT` of the robot that the reader starts first."""
    command = [sys.executable, "-m", "gatewayd", "simulate", "--port", "0", "--program", "demo"]
    with ExitStack() as stack:
        program = stack.enter_context(
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        )
        stack.callback(program.terminate)
        assert program.stdout is not None
        found = re.search(r"127\.0\.0\.1:\d+", program.stdout.readline())
        assert found
        yield found[0]


def run(line: str, robot: str, directory: Path) -> subprocess.CompletedProcess[str]:
    """A command of the page, for the robot of the test.

    Other tests run gateways at the same time, also such whose mapping cannot be read: `set` writes beside none of
    these, so it is given again until they have gone.
    """
    end = time.monotonic() + PATIENCE
    while True:
        done = _run(line, robot, directory)
        if STRANGE_GATEWAY not in done.stderr or time.monotonic() > end:
            return done


def _run(line: str, robot: str, directory: Path) -> subprocess.CompletedProcess[str]:
    arguments = shlex.split(line.replace("127.0.0.1", robot))[1:]
    return subprocess.run(
        [sys.executable, "-m", "gatewayd", *arguments],
        cwd=directory,
        env={"PYTHONPATH": str(DOCS.parent), "MPLCONFIGDIR": str(directory)},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


@pytest.mark.slow
def test_commands_do_what_the_page_says(robot: str, tmp_path: Path) -> None:
    lines = [line for line in commands(PAGE) if line.startswith("gatewayd rtde ") and " watch " not in line]
    done = {line.split()[2]: run(line, robot, tmp_path) for line in lines}
    assert {name: result.stderr for name, result in done.items() if result.returncode} == {}
    assert {"info", "get", "fields", "set", "record", "plot"} == set(done)
    assert done["get"].stdout.split() == ["output_int_register_0", "7"]
    assert (tmp_path / "robot.csv").read_text().startswith("timestamp actual_q_0 ")
    assert (tmp_path / "robot.png").stat().st_size


def test_writing_is_refused_as_the_page_says(robot: str, tmp_path: Path) -> None:
    (line,) = re.findall(r"^`(gatewayd rtde set .*?)` writes nothing", PAGE.read_text(), re.MULTILINE)
    done = run(line, robot, tmp_path)
    assert done.returncode == 1
    assert "nothing was written: the program is running; --while-running" in done.stderr
