"""How far the reading of a recording is, on a terminal."""

from __future__ import annotations

import errno
import os
import pty
import subprocess
import sys
from pathlib import Path

import click
from click.testing import CliRunner

from gatewayd.cli.rtde.recordings import reported


def test_progress_is_shown_on_a_terminal_and_wiped_off(tmp_path: Path) -> None:
    source = tmp_path / "robot_data.csv"
    source.write_text("timestamp\n" + "0.002\n" * 20_000)
    terminal, end = pty.openpty()
    done = subprocess.run(
        [sys.executable, "-m", "gatewayd", "rtde", "convert", source, tmp_path / "x.bin"],
        stderr=end,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        timeout=60,
    )
    os.close(end)
    shown = os.read(terminal, 65536).decode()
    os.close(terminal)
    assert shown.startswith("\r\033[K  1%, 256 packages\r\033[K")
    assert shown.endswith("\r\x1b[K")
    assert done.stdout.startswith(f"{tmp_path / 'x.bin'}: 20000 packages, ")


def test_a_medium_that_fails_ends_in_one_line() -> None:
    @click.command()
    @click.pass_context
    def broken(context: click.Context) -> None:
        with reported(context):
            raise OSError(errno.EIO, "Input/output error")

    done = CliRunner().invoke(broken)
    assert (done.exit_code, done.stderr) == (1, "a recording cannot be read: Input/output error\n")
