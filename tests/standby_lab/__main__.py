"""`python -m tests.standby_lab --faults 100 --release 1`: random faults, what they cost, and what the judge says."""

from __future__ import annotations

import argparse
import statistics
import tempfile
from pathlib import Path

from tests.standby_lab.judge import packages, violations
from tests.standby_lab.lab import FAULTS, Lab, Outcome, faults, usable


def main() -> None:
    """Print a line for each fault, a table, and the judgement."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", type=int, default=100)
    parser.add_argument(
        "--release", type=float, default=1.0, help="seconds until the robot drops a silent client"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", choices=FAULTS, help="kind of fault")
    options = parser.parse_args()
    if not usable():
        parser.error("needs root, iproute2, util-linux and keepalived")
    outcomes: dict[str, list[Outcome]] = {}
    with tempfile.TemporaryDirectory() as directory, Lab(Path(directory), options.release) as lab:
        chosen = [options.only] * options.faults if options.only else faults(options.faults, options.seed)
        for number, fault in enumerate(chosen, 1):
            outcome = lab.do(fault, lab.active())
            outcomes.setdefault(fault, []).append(outcome)
            print(f"{number:3} {outcome}", flush=True)
        lab.active()
        lines = (lab.directory / "robot.jsonl").read_text().splitlines()
    for fault, each in sorted(outcomes.items()):
        times = [outcome.served * 1000 for outcome in each]
        later = max(outcome.served - outcome.released for outcome in each) * 1000
        kept = sum(outcome.kept for outcome in each)
        print(
            f"{fault:12} {len(times):3} times: median {statistics.median(times):6.0f} ms, "
            f"longest {max(times):6.0f} ms; longest since the inputs were free {later:5.0f} ms; "
            f"{kept} within {each[0].aim:g} s"
        )
    found = list(violations(lines))
    print(f"judge: {packages(lines)} input packages accepted, {len(found)} violations")
    for text in found[:10]:
        print(text)
    raise SystemExit(bool(found))


if __name__ == "__main__":
    main()
