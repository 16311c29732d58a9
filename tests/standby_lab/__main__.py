"""`python -m tests.standby_lab --faults 100 --release 1`: random faults, what they cost, and what the judge says."""

from __future__ import annotations

import argparse
import statistics
import tempfile
from pathlib import Path

from tests.standby_lab.judge import packages, violations
from tests.standby_lab.lab import Lab, faults, usable


def main() -> None:
    """Print a line for each fault, a table, and the judgement."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=100)
    parser.add_argument(
        "--release", type=float, default=1.0, help="seconds until the robot drops a silent client"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="kind of fault")
    options = parser.parse_args()
    if not usable():
        parser.error("needs root, iproute2, util-linux and keepalived")
    took: dict[str, list[float]] = {}
    since: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as directory, Lab(Path(directory), options.release) as lab:
        chosen = [options.only] * options.faults if options.only else faults(options.faults, options.seed)
        for number, fault in enumerate(chosen, 1):
            released, seconds = lab.do(fault, lab.active())
            took.setdefault(fault, []).append(seconds)
            since.setdefault(fault, []).append(seconds - released)
            print(
                f"{number:3} {fault:12} served after {seconds * 1000:6.0f} ms, "
                f"inputs free after {released * 1000:6.0f} ms",
                flush=True,
            )
        lab.active()
        lines = (lab.directory / "robot.jsonl").read_text().splitlines()
    for fault, times in sorted(took.items()):
        median, most = statistics.median(times) * 1000, max(times) * 1000
        longest = max(since[fault]) * 1000
        print(
            f"{fault:12} {len(times):3} times, median {median:6.0f} ms, longest {most:6.0f} ms; "
            f"longest since the inputs were free {longest:5.0f} ms"
        )
    found = list(violations(lines))
    print(f"judge: {packages(lines)} input packages accepted, {len(found)} violations")
    for text in found[:10]:
        print(text)
    raise SystemExit(bool(found))


if __name__ == "__main__":
    main()
