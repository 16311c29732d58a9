"""All fields of a robot at its full rate, for half a minute: every package that was sent is in the file."""

from __future__ import annotations

import csv
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest

from gatewayd.rtde.fields import OUTPUTS, Series, SoftwareVersion
from tests.benchmarks.controller import Controller
from tests.e2e.processes import HOST, Process, free_port

PERIOD = 0.002
SECONDS = 30
PACKAGES = round(SECONDS / PERIOD)
NAMES = [name for name, field in OUTPUTS.items() if field.available(Series.E, SoftwareVersion(5, 26))]


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_no_package_is_lost(tmp_path: Path) -> None:
    """The controller here sends when it is told to, so what does not come was lost by the recorder."""
    assert len(NAMES) > 400
    port, file, recipe = free_port(), tmp_path / "robot.csv", tmp_path / "all.txt"
    recipe.write_text("\n".join(NAMES) + "\n")
    controller = Controller(port, HOST)
    options = ("--config", str(recipe), "--samples", str(PACKAGES))
    command = (sys.executable, "-m", "gatewayd", "rtde", "record", f"{HOST}:{port}", str(file), *options)
    recorder = Process(command, tmp_path / "log")
    try:
        controller.wait_for_start()
        due = time.perf_counter()
        for _ in range(PACKAGES):
            controller.pump(0)
            controller.send()
            due += PERIOD
            time.sleep(max(0.0, due - time.perf_counter()))
        assert recorder.wait() == 0, recorder.text()
    finally:
        recorder.kill()
        controller.close()
    with file.open(newline="") as stream:
        reader = csv.reader(stream, delimiter=" ")
        place = next(reader).index("timestamp")
        times = [float(row[place]) for row in reader]
    assert len(times) == PACKAGES
    assert all(earlier < later for earlier, later in pairwise(times))
