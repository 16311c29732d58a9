"""How far the reading of a recording is, on a terminal."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path


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
    assert "\r  1%, 256 packages\r  3%, 512 packages" in shown
    assert shown.endswith("\r\x1b[K")
    assert done.stdout.startswith(f"{tmp_path / 'x.bin'}: 20000 packages, ")
