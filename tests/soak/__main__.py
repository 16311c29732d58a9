"""`make soak`: an hour of faults, and what the daemon made of them. Exit code 1 if anything was not as it should be."""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
from pathlib import Path

from tests.soak.faults import FAULTS, ROUND
from tests.soak.run import PAUSES, soak


def _main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__)
    given = float(os.environ.get("GATEWAYD_SOAK_SECONDS", "3600"))
    parser.add_argument("--seconds", type=float, default=given, help=f"length of the run (default {given:g})")
    parser.add_argument(
        "--seed", type=int, default=random.randrange(2**32), help="which faults (default: any)"
    )
    parser.add_argument("--speed", choices=sorted(PAUSES), default="real", help="pauses between faults")
    parser.add_argument(
        "--only", choices=sorted(FAULTS), action="append", help="this kind of fault (repeatable)"
    )
    parser.add_argument(
        "--witness",
        choices=("fail", "report"),
        default="fail",
        help="what follows from a finding about what the robot got: failure (default), or only a line",
    )
    options = parser.parse_args()
    # However it is ended, its processes end with it.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    directory = Path(tempfile.mkdtemp(prefix="gatewayd-soak-"))
    print(f"soak: {options.seconds:g} s, --seed {options.seed}, --speed {options.speed}", flush=True)
    measured = soak(
        directory,
        options.seconds,
        options.seed,
        options.speed,
        lambda line: print(line, flush=True),
        among=options.only or ROUND,
    )
    for table in measured.tables():
        print(f"\n{table}")
    if options.witness == "report":
        for one in measured.lies:
            print(f"soak: TO LOOK AT: {one}")
        measured.lies = []
    found = measured.verdict()
    for one in found:
        print(f"soak: NOT GOOD: {one}")
    print(f"soak: logs in {directory}" if found else "soak: all well")
    if not found:
        shutil.rmtree(directory)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(_main())
