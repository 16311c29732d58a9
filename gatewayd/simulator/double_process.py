"""Simulated robots in a process of their own, for tests: `gatewayd simulate`, told what to do on standard input."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path

from gatewayd.simulator.fleet import RobotHost

_PATIENCE = 10.0  # seconds for which it may take to end


class RobotProcessError(Exception):
    """The process of the simulated robots has ended; the text is what it said."""


class ProcessBackend:
    """The process, with robots of these names: of a scenario's content, unless `replay` names a recording."""

    def __init__(
        self, names: Sequence[str], scenario: str, at: RobotHost, replay: str | Path | None, *, repeat: bool
    ) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._lock = threading.Lock()
        file = Path(self._folder.name, "scenario.toml")
        file.write_text(scenario, "utf-8")
        source = ["--scenario", str(file)] if replay is None else ["--replay", str(replay)]
        time = ["--stepped"] if at.stepped else ["--speed", str(at.speed)]
        options = [*source, *["--loop"][: replay is not None and repeat], *time]
        self._errors = Path(self._folder.name, "stderr")
        with self._errors.open("wb") as errors:
            self._process = subprocess.Popen(  # noqa: S603 - this program, with options of the test's author
                [
                    *(sys.executable, "-m", "gatewayd", "simulate", "--control", "stdin", "--quiet"),
                    *("--host", at.host, "--port", str(at.ports[0]), *options),
                ],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                encoding="utf-8",
            )
        try:
            self.ports = {name: int(self._line().rpartition(":")[2]) for name in names}
        except BaseException:
            self.close()
            raise

    def execute(self, line: str) -> str:
        """One command line and its answer; RobotProcessError if there is none."""
        with self._lock:
            if self._process.stdin is None or self._process.poll() is not None:
                raise RobotProcessError(self._said())
            try:
                self._process.stdin.write(line.replace("\n", " ") + "\n")
                self._process.stdin.flush()
            except BrokenPipeError:
                raise RobotProcessError(self._said()) from None
            return self._line()

    def close(self) -> None:
        """End it, and show what it has complained of."""
        if self._process.stdin is None or self._process.stdin.closed:
            return
        self._process.terminate()
        try:
            self._process.communicate(timeout=_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
        sys.stderr.write(self._said())
        self._folder.cleanup()

    def _line(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._process.wait(_PATIENCE)
            raise RobotProcessError(self._said())
        return line.rstrip("\n")

    def _said(self) -> str:
        return self._errors.read_text("utf-8", "replace")
