"""Time of `gatewayd check` for a full-image mapping, as a process."""

from __future__ import annotations

import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median

from tests.benchmarks.image import full_image
from tests.benchmarks.processes import gatewayd, python
from tests.benchmarks.report import Table, at_most

ROUNDS = 7
AIM = 0.3


def run(seconds: float) -> list[Table]:
    """One table; a check takes as long as it takes, whatever `seconds` says."""
    del seconds
    table = Table(
        "Start and check",
        "Wall-clock time of whole processes, median of seven; the interpreter's own start is part of each.",
        ("command", "seconds"),
    )
    with tempfile.TemporaryDirectory() as folder:
        mapping = Path(folder) / "full.yaml"
        mapping.write_text(full_image(30004, 1502))
        table.add("python -c pass", f"{_time(python('-c', 'pass')):.3g}")
        table.add("gatewayd --help", f"{_time(gatewayd('--help')):.3g}")
        table.add("gatewayd check, full image", at_most(_time(gatewayd("check", mapping)), AIM, " s"))
    return [table]


def _time(command: list[str]) -> float:
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - begin)
    return median(times)
