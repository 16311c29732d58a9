"""A machine that serves what a git repository has: repository, the script of systemd/examples, and its directory."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "systemd" / "examples"
SCRIPT = EXAMPLES / "gatewayd-mappings"
NEEDED = ("git", "flock", "timeout")
"""Programs that the script calls, beside those that every Debian has."""

needs_git = pytest.mark.skipif(
    not all(map(shutil.which, NEEDED)),
    reason="git, flock or timeout is missing (Debian packages git, util-linux)",
)
AUTHOR = {
    "GIT_AUTHOR_NAME": "plant",
    "GIT_AUTHOR_EMAIL": "plant@example.org",
    "GIT_COMMITTER_NAME": "plant",
    "GIT_COMMITTER_EMAIL": "plant@example.org",
    "GIT_CONFIG_GLOBAL": "/dev/null",
    "GIT_CONFIG_NOSYSTEM": "1",
}
REAL_GATEWAYD = f"""#!/bin/sh
PYTHONPATH='{ROOT}' exec '{sys.executable}' -m gatewayd "$@"
"""


class Site:
    """`work` is somebody's clone, whose branch main the machine follows; `state` is the machine's."""

    def __init__(self, directory: Path, gatewayd: str = REAL_GATEWAYD) -> None:
        self.work, self.state = directory / "work", directory / "state"
        self.bin, self.metrics = directory / "bin", directory / "metrics.prom"
        self.settings, self.socket = directory / "settings", directory / "control.sock"
        self.bin.mkdir()
        self.program("gatewayd", gatewayd)
        self.environment = {
            "PATH": f"{self.bin}:/usr/sbin:/usr/bin:/sbin:/bin",
            "HOME": str(directory),
            "STATE_DIRECTORY": str(self.state),
            "MAPPINGS_SETTINGS": str(self.settings),
            "GATEWAYD_CONTROL": str(self.socket),
            **AUTHOR,
        }
        self.set()
        self.git("init", "--quiet", "--initial-branch=main", self.work, at=directory)

    def set(self, remote: str | Path = "", **more: str | Path) -> None:
        """Write the settings."""
        named = {"REMOTE": remote or self.work, "DIRECTORY": "cells/press", "METRICS": self.metrics, **more}
        self.settings.write_text("".join(f"MAPPINGS_{name}='{value}'\n" for name, value in named.items()))

    def program(self, name: str, text: str) -> None:
        """One that is found before those of the machine."""
        path = self.bin / name
        path.write_text(text)
        path.chmod(0o755)

    def git(self, *arguments: str | Path, at: Path | None = None, text: str | bytes = "") -> str:
        """What git says, in the clone."""
        done = subprocess.run(
            ["git", *map(str, arguments)],
            cwd=at or self.work,
            env=self.environment,
            input=text.encode() if isinstance(text, str) else text,
            capture_output=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr.decode()
        return done.stdout.decode().strip()

    def commit(self, files: Mapping[str, str], message: str = "change", *options: str) -> str:
        """Change files of this machine's directory; the commit."""
        for name, text in files.items():
            path = self.work / "cells/press" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        self.git("add", "--all")
        self.git("commit", "--quiet", "--allow-empty", "-m", message, *options)
        return self.git("rev-parse", "HEAD")

    def run(
        self, *arguments: str, before: Sequence[str] = (), **environment: str
    ) -> subprocess.CompletedProcess[str]:
        """The script, as its unit runs it; `before` is a command that runs it."""
        return subprocess.run(
            [*before, SCRIPT, *arguments],
            env={**self.environment, **environment},
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
            start_new_session=True,
        )

    def served(self, *arguments: str) -> str:
        """What the script says; it has to succeed."""
        done = self.run(*arguments)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def refused(self, *arguments: str, code: int = 1) -> str:
        """What the script says; it has to fail."""
        done = self.run(*arguments)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    @property
    def current(self) -> Path:
        return self.state / "current"

    def files(self) -> dict[str, str]:
        """What the gateway finds."""
        if not self.current.exists():
            return {}
        found = (path for path in self.current.resolve().rglob("*") if path.is_file())
        return {str(path.relative_to(self.current.resolve())): path.read_text() for path in found}

    def figures(self) -> dict[str, float]:
        """The metrics that the script leaves for node_exporter."""
        lines = self.metrics.read_text().splitlines()
        return {line.rpartition(" ")[0]: float(line.rpartition(" ")[2]) for line in lines if line[0] != "#"}
