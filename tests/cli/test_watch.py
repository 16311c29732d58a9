"""`gatewayd watch` as a program: lines in a pipe, a picture and keys in a real terminal."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from tests.cli.conftest import Invoke, Running


@pytest.mark.usefixtures("gateway")
def test_one_look_as_lines(invoke: Invoke) -> None:
    done = invoke("watch", "--once", "cyc")
    assert done.exit_code == 0
    assert "<- cycles" in done.output
    assert "speed" not in done.output


@pytest.mark.usefixtures("gateway")
def test_names_are_escaped_as_nothing_else(invoke: Invoke) -> None:
    """Brackets in names are no markup."""
    assert "tcp[2]" in invoke("watch", "--once").output


@dataclass
class Terminal:
    """What a person sees and types."""

    master: int
    program: subprocess.Popen[bytes]
    seen: str = ""

    def wait_for(self, text: str) -> None:
        end = time.monotonic() + 20
        while text not in self.seen:
            assert time.monotonic() < end, self.seen[-3000:]
            if select.select([self.master], [], [], 0.1)[0]:
                try:
                    self.seen += os.read(self.master, 65536).decode(errors="replace")
                except OSError:
                    assert text in self.seen
                    return

    def type(self, text: str) -> None:
        self.seen = ""
        os.write(self.master, text.encode())


@pytest.fixture
def terminal(gateway: Running) -> Iterator[Terminal]:
    master, slave = pty.openpty()
    environ = {
        **os.environ,
        "GATEWAYD_CONTROL": str(gateway.path),
        "TERM": "xterm-256color",
        "COLUMNS": "100",
        "LINES": "30",
    }
    command = [sys.executable, "-m", "gatewayd", "watch", "--interval", "100ms"]
    program = subprocess.Popen(command, stdin=slave, stdout=slave, stderr=slave, env=environ, close_fds=True)
    os.close(slave)
    found = Terminal(master, program)
    yield found
    program.kill()
    program.wait()
    os.close(master)


def test_a_picture_keys_and_the_end(terminal: Terminal, gateway: Running) -> None:
    terminal.wait_for("q quit")
    assert "cycles" in terminal.seen
    terminal.type("/tcp")
    terminal.wait_for("filter: tcp")
    terminal.type("\x1b")
    terminal.wait_for("q quit")
    gateway.do(lambda cell: cell.robot_lost("gone", 1.0))
    terminal.wait_for("robot not connected")
    terminal.type("q")
    assert terminal.program.wait(10) == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_it_and_leaves_the_terminal_as_it_was(terminal: Terminal, number: int) -> None:
    before = termios.tcgetattr(terminal.master)
    terminal.wait_for("q quit")
    assert termios.tcgetattr(terminal.master) != before
    terminal.program.send_signal(number)
    terminal.wait_for("\x1b[?1049l")
    assert terminal.program.wait(10) == 0
    assert termios.tcgetattr(terminal.master) == before
    assert "Traceback" not in terminal.seen
