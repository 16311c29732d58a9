"""The examples do what they say, with the simulator as another process."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import pairwise, takewhile
from pathlib import Path

import pytest

from tests.docs.examples import EXAMPLES, path_of

PATIENCE = 30.0

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def port() -> Iterator[str]:
    """The port of a simulated robot."""
    command = [sys.executable, "-m", "gatewayd", "simulate", "--port", "0", "--program"]
    with ExitStack() as stack:
        robot = stack.enter_context(
            subprocess.Popen(
                [*command, "output_int_register_25 = input_int_register_25 after 20ms"],
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
            )
        )
        stack.callback(robot.terminate)
        assert robot.stdout is not None
        found = re.search(r":(\d+)", robot.stdout.readline())
        assert found
        yield found[1]


@pytest.fixture
def run(port: str) -> Run:
    """An example with its arguments behind host and port; it has to end well."""

    def start(name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [sys.executable, path_of(name), "127.0.0.1", port, *arguments],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done

    return start


def test_read(run: Run) -> None:
    lines = run("read", "5").stdout.splitlines()
    assert re.fullmatch(r"controller 5\.\S+, 500 packages per second", lines[0])
    times = [float(line.split()[0]) for line in lines[1:]]
    assert len(times) == 5
    assert all(earlier < later for earlier, later in pairwise(times))


def test_record(run: Run, tmp_path: Path) -> None:
    done = run("record", str(tmp_path / "robot.csv"), "0.2")
    counts = re.fullmatch(r"(\d+) packages, (\d+) skipped by the controller\n", done.stdout)
    assert counts
    assert int(counts[1]) + int(counts[2]) >= 100
    first, *rows = (tmp_path / "robot.csv").read_text().splitlines()
    assert first.startswith("timestamp actual_q_0 actual_q_1")
    assert len(rows) == int(counts[1])


def test_plot(run: Run, tmp_path: Path) -> None:
    recording, picture = tmp_path / "robot.csv", tmp_path / "robot.png"
    run("record", str(recording), "0.1")
    subprocess.run(
        [sys.executable, path_of("plot"), recording, picture],
        env={**os.environ, "MPLBACKEND": "agg", "MPLCONFIGDIR": str(tmp_path)},
        check=True,
        timeout=2 * PATIENCE,
    )
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_control_loop(run: Run) -> None:
    lines = run("control-loop", "4").stdout.splitlines()
    assert [line.split(" at")[0] for line in lines] == [f"point {number} reached" for number in range(1, 5)]


def test_io_panel(port: str) -> None:
    with subprocess.Popen(
        [sys.executable, path_of("io-panel"), "127.0.0.1", port],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as panel:
        assert panel.stdin is not None
        assert panel.stdout is not None
        panel.stdin.write("9\n3\n")
        panel.stdin.flush()
        shown = list(takewhile(lambda line: "out 00001000" not in line, panel.stdout))
        assert "'9' is not an output: 0 to 7, or q\n" in shown
        panel.stdin.write("q\n")
        panel.stdin.close()
        assert panel.wait(PATIENCE) == 0


def test_notebook(run: Run) -> None:
    assert run("notebook").stdout.splitlines()[1] == "the controller has taken 7"


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_without_arguments_an_example_says_which_it_takes(path: Path) -> None:
    done = subprocess.run(
        [sys.executable, path], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"usage: {path.name} ")


def test_no_example_is_left_out() -> None:
    tested = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    tested |= {
        "can_encoder",
        "gripper",
        "io_island",
    }  # devices: tests/docs/test_device_tutorials.py plays with them
    assert {path.stem for path in EXAMPLES.glob("*.py")} <= tested
