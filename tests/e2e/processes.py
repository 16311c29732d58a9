"""The programs of a plant as processes of their own: started, waited for, asked, killed. Never a bare sleep."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

PATIENCE = 15.0
"""Seconds for what should take a moment: the machine may be busy, and a red test must not be its fault."""
_PAUSE = 0.004
_ROOT = Path(__file__).parents[2]
"""Where `gatewayd` and `tests` are found by programs that are started as modules."""
_PORTS = itertools.count(20000)


def _own_address() -> str:
    """A loopback address that no other test process uses, so that ports need no coordination."""
    number = os.getpid()
    return f"127.{64 + (number >> 16 & 63)}.{number >> 8 & 255}.{number & 255}"


HOST = _own_address()
"""Where everything that these tests start listens; below the ephemeral range every port of it is ours."""


def free_port() -> int:
    """A port of `HOST` that was never used."""
    return next(_PORTS)


def wait_for(condition: Callable[[], bool], what: str, limit: float = PATIENCE) -> float:
    """Return as soon as `condition` holds, with the seconds it took; AssertionError names `what` did not come."""
    start = time.monotonic()
    while not condition():
        waited = time.monotonic() - start
        assert waited < limit, f"waited {waited:.1f} s in vain for {what}"
        time.sleep(_PAUSE)
    return time.monotonic() - start


class Process:
    """One program; what it prints goes to `log`."""

    def __init__(self, command: Sequence[str], log: Path, *, pass_fds: Sequence[int] = ()) -> None:
        self.log = log
        with log.open("wb") as stream:
            self.popen = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=stream,
                text=True,
                bufsize=1,
                cwd=_ROOT,
                pass_fds=pass_fds,
            )

    @property
    def pid(self) -> int:
        return self.popen.pid

    @property
    def running(self) -> bool:
        return self.popen.poll() is None

    def text(self) -> str:
        """What it has logged so far."""
        return self.log.read_text("utf-8", "replace")

    def lines(self, *parts: str) -> list[str]:
        """The log lines that contain all `parts`."""
        return [line for line in self.text().splitlines() if all(part in line for part in parts)]

    def wait_for_line(self, *parts: str, count: int = 1) -> str:
        """The `count`-th log line that contains all `parts`, once it is there."""
        wait_for(lambda: len(self.lines(*parts)) >= count, f"{parts} in the log of {self.log.name}")
        return self.lines(*parts)[count - 1]

    def answer(self) -> str:
        """The next line of standard output."""
        assert self.popen.stdout is not None
        return self.popen.stdout.readline().strip()

    def signal(self, number: signal.Signals) -> None:
        self.popen.send_signal(number)

    def wait(self, limit: float = PATIENCE) -> int:
        """The exit code."""
        return self.popen.wait(limit)

    def kill(self) -> None:
        """End it without giving it a chance (SIGKILL)."""
        self.popen.kill()
        self.popen.wait()
        for stream in (self.popen.stdin, self.popen.stdout):
            if stream is not None:
                stream.close()

    def resident_kilobytes(self) -> int:
        """Memory that it occupies now (VmRSS)."""
        status = Path(f"/proc/{self.pid}/status").read_text("ascii")
        return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS:")))

    def cpu_seconds(self) -> float:
        """User and system time used (proc(5), fields 14 and 15 of stat)."""
        found = Path(f"/proc/{self.pid}/stat").read_text("ascii").rpartition(")")[2].split()
        return (int(found[11]) + int(found[12])) / os.sysconf("SC_CLK_TCK")


class Simulator(Process):
    """`gatewayd simulate`, listening when constructed; commands by `do`."""

    def __init__(self, log: Path, *options: str, port: int = 0, frequency: float = 125) -> None:
        command = [sys.executable, "-m", "gatewayd", "simulate", "--host", HOST, "--port", str(port)]
        super().__init__([*command, "--frequency", f"{frequency:g}", "--control", "stdin", *options], log)
        said = self.answer()
        assert said.startswith(f"listening on {HOST}:"), said + self.text()
        self.port = int(said.rpartition(":")[2])

    def do(self, command: str) -> str:
        """Carry out a command; its result."""
        assert self.popen.stdin is not None
        self.popen.stdin.write(command + "\n")
        answer = self.answer()
        assert answer.split(" ")[0] == "ok", f"{command}: {answer}"
        return answer[3:]

    def integer(self, field: str) -> int:
        return int(self.do(f"get {field}"))

    def number(self, field: str) -> float:
        return float(self.do(f"get {field}"))


class Daemon(Process):
    """`gatewayd run`."""

    def __init__(self, log: Path, *arguments: str | Path) -> None:
        super().__init__([sys.executable, "-m", "gatewayd", "run", *map(str, arguments)], log)

    def stop(self) -> tuple[int, float]:
        """SIGTERM; the exit code, and the seconds it took."""
        start = time.monotonic()
        self.signal(signal.SIGTERM)
        return self.wait(), time.monotonic() - start
