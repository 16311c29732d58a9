"""`gatewayd rtde watch` as a program: lines in a pipe, a picture and q in a real terminal."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.cli.rtde.robot import place, rtde
from tests.e2e.plant import Plant
from tests.e2e.processes import HOST, Process, free_port


def test_lines_where_nobody_looks(plant: Plant, tmp_path: Path) -> None:
    simulator = plant.simulator()
    line = [
        sys.executable,
        "-m",
        "gatewayd",
        "rtde",
        "watch",
        place(simulator),
        "runtime_state",
        "--interval",
        "100ms",
    ]
    program = Process(line, tmp_path / "watch.log")
    head, state, blank, again = (program.answer() for _ in range(4))
    assert head.startswith(f"{place(simulator)}  1")
    assert (state, blank) == ("runtime_state  2  (running)", "")
    assert again.startswith(place(simulator))
    simulator.kill()
    while "everything below is old" not in program.answer():
        assert program.running
    assert program.answer() == "runtime_state  2  (running)", "what was there last"
    program.signal(signal.SIGINT)
    assert program.wait() == 0
    assert program.text() == ""
    program.kill()


def test_a_picture_and_q(plant: Plant) -> None:
    simulator = plant.simulator()
    master, slave = pty.openpty()
    line = [sys.executable, "-m", "gatewayd", "rtde", "watch", place(simulator), "--interval", "100ms"]
    environ = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "100", "LINES": "30"}
    program = subprocess.Popen(line, stdin=slave, stdout=slave, stderr=slave, env=environ, close_fds=True)
    os.close(slave)
    seen, end = "", time.monotonic() + 20
    while "q quit" not in seen:
        assert time.monotonic() < end, seen
        if select.select([master], [], [], 0.1)[0]:
            seen += os.read(master, 65536).decode(errors="replace")
    assert "actual_TCP_pose" in seen
    os.write(master, b"q")
    assert program.wait(20) == 0
    os.close(master)


def test_who_cannot_be_reached_is_said() -> None:
    result = rtde("watch", f"{HOST}:{free_port()}", "actual_q")
    assert result.exit_code == 1
    assert "its RTDE service is off" in result.output
