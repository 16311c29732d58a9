"""`make bench`: measure, and print every figure beside its aim. `make bench ARGS="latency cost"`: some of them."""

from __future__ import annotations

import argparse
import os
import platform
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from tests.benchmarks.report import Table
from tests.benchmarks.trees import HERE, Job, before

SUBJECTS = {
    "throughput": "Modbus requests per second and round trips, beside libmodbus and the stock pymodbus server",
    "latency": "robot to PLC and PLC to robot, as histograms, beside a gateway in C",
    "cost": "CPU time and memory of the daemon with the full image at 500 Hz, beside a gateway in C",
    "packages": "packages of the robot that were not shown, one by one and in bursts",
    "fleet": "a process for each cell, a thousand edge nodes at one broker, and a broker that is away for an hour",
    "growth": "cells, connections and variables: what each of them adds, and where that ends",
    "canopen": "CPU per PDO, a saturated bus and SYNC, beside python-canopen's own node",
    "rtde": "RTDE clients: CPU per package, recordings, a control loop, beside ur_rtde and the official style",
    "devices": "the Modbus client: polls per second and CPU, silent units, beside pymodbus's and libmodbus's",
    "check": "start and `gatewayd check`, as multiples of an empty Python",
    "script": "the script that a user would write instead: ur_rtde feeding a pymodbus server",
}
"""Module -> what it measures. Each has `run(job) -> list[Table]`."""


def _main() -> None:
    subjects = "\n".join(f"  {name:<11} {text}" for name, text in SUBJECTS.items())
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks",
        description=f"Measure gatewayd on this machine.\n\nsubjects (default: all):\n{subjects}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("subjects", nargs="*", metavar="SUBJECT", default=list(SUBJECTS))
    parser.add_argument("--seconds", type=float, default=3.0, help="length of each measurement (default 3)")
    parser.add_argument(
        "--against",
        type=Path,
        metavar="DIR",
        help="also measure gatewayd of the checkout in DIR (installed there by `make dev`), in turn with this one",
    )
    options = parser.parse_args()
    unknown = set(options.subjects) - set(SUBJECTS)
    if unknown:
        parser.error(f"no subject is called {', '.join(sorted(unknown))}")
    trees = (HERE,) if options.against is None else (HERE, before(options.against))
    try:
        for tree in trees:
            tree.check()
    except (OSError, RuntimeError) as error:
        parser.error(str(error))
    job = Job(options.seconds, trees)
    # Installed packages are compiled; where this variable is set, gatewayd would be compiled anew at each start.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    print(
        f"{platform.python_implementation()} {platform.python_version()}, {os.cpu_count()} cores, {platform.machine()}"
    )
    for subject in options.subjects:
        run: Callable[[Job], list[Table]] = import_module(f"tests.benchmarks.{subject}").run
        for table in run(job):
            print(f"\n{table}\n", flush=True)


if __name__ == "__main__":
    _main()
