"""The RTDE library and its recorder beside other clients: CPU per package, recordings, a control loop."""

from __future__ import annotations

import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from statistics import median

from gatewayd.rtde.fields import OUTPUTS, Series, SoftwareVersion
from tests.benchmarks.image import STATE
from tests.benchmarks.processes import python, running
from tests.benchmarks.report import Table, percentile
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.trees import HERE, Job
from tests.benchmarks.usage import usage
from tests.e2e.processes import wait_for

RATE = 500
ROUNDS = 3
PORT = 30004
"""ur_rtde knows no other, so each robot gets a loopback address of its own."""
CLIENT = Path(__file__).with_name("rtde_client.py")
REGISTERS = [f"output_{kind}_register_{number}" for kind in ("int", "double") for number in range(5)]
USUAL = ("timestamp", *STATE[:19], *REGISTERS)
"""Thirty fields."""
NEWEST = SoftwareVersion(5, 26, 0)
LOOPS = 500
SETTLE = 1.0

OURS = ("gatewayd", "gatewayd.sync")
READING = f"""\
CPU time of the client's process for each package at {RATE} Hz, in us; it looks at eight fields of each. `gatewayd` is
the asynchronous API, `gatewayd.sync` the blocking one. `official` is written in the style of the client that Universal
Robots publishes: blocking, an object for each package, a struct call for each field. ur_rtde receives in C++, and is
asked for eight fields in each cycle; it does not know all fields. Median of {ROUNDS} rounds, in each of which every
client has its turn.
{RULE}"""
RECORDING = f"""\
`gatewayd rtde record` of all fields of a simulated robot at {RATE} Hz. CPU as a share of a core; bytes of a package."""
LOOP = f"""\
A number is written as soon as the one before was seen: cycles of the controller from the sample that the program had
when it wrote until the one that shows the echo, and ms until the program saw it; {LOOPS} times."""

_hosts = (f"127.0.4.{number}" for number in count(1))


def run(job: Job) -> list[Table]:
    """Three tables."""
    return [_reading(job), _recordings(job), _loops()]


def everything() -> tuple[str, ...]:
    """All outputs of the newest e-Series software in the catalogue."""
    return tuple(name for name, field in OUTPUTS.items() if field.available(Series.E, NEWEST))


@contextmanager
def _robot(*options: str) -> Iterator[str]:
    """The address of a simulated robot."""
    host = next(_hosts)
    command = ("simulate", "--host", host, "--port", str(PORT), "--version", "5.26.0", *options)
    with running(HERE.gatewayd(*command)):
        wait_for(partial(_listens, host), "the robot")
        yield host


def _listens(host: str) -> bool:
    try:
        socket.create_connection((host, PORT), 1).close()
    except OSError:
        return False
    return True


def _reading(job: Job) -> Table:
    others = ["official", *(["ur_rtde"] if find_spec("rtde_receive") else [])]
    pairs = [(ours, other) for ours in OURS for other in others]
    samples = Samples()
    table = Table(
        "An RTDE client's CPU time",
        READING,
        ("recipe", *OURS, *others, *(f"{ours} / {other}" for ours, other in pairs), *NOISE),
    )
    for title, names in (("30 fields", USUAL), (f"{len(everything())} fields", everything())):
        used = [*OURS, *(kind for kind in others if kind != "ur_rtde" or names is USUAL)]
        rounds = [
            {kind: _cpu(kind, names, job.seconds, title, samples) for kind in used} for _ in range(ROUNDS)
        ]
        found = {kind: median(one[kind] for one in rounds) for kind in used}
        cells = [f"{found[kind] * 1e6:.1f}" if kind in found else "-" for kind in (*OURS, *others)]
        ratios = [f"{found[ours] / found[other]:.2f}" if other in found else "-" for ours, other in pairs]
        table.add(title, *cells, *ratios, *samples.noise(title))
    table.note = samples.note
    return table


def _cpu(kind: str, names: tuple[str, ...], seconds: float, title: str, samples: Samples) -> float:
    """Seconds of CPU for each package."""
    with _robot() as host, running(python(CLIENT, "read", kind, host, str(PORT), *names)) as client:
        time.sleep(SETTLE)
        pid = client.pid

        def share() -> float:
            before = usage(pid)
            time.sleep(seconds / ROUNDS)
            used = usage(pid) - before
            return used.cpu / (used.wall * RATE)

        return samples.take(title, pid, share)


def _recordings(job: Job) -> Table:
    samples = Samples()
    table = Table(
        "Recording all fields", RECORDING, ("format", "CPU", "bytes", "packages", "not in the file", *NOISE)
    )
    for title, options in (("text", ()), ("binary", ("--binary",))):
        table.add(title, *_recorded(title, options, max(job.seconds, 3.0), samples), *samples.noise(title))
    table.note = samples.note
    return table


def _recorded(title: str, options: tuple[str, ...], seconds: float, samples: Samples) -> tuple[str, ...]:
    with _robot() as host, tempfile.TemporaryDirectory() as folder:
        file, recipe = Path(folder, "robot.csv"), Path(folder, "all.txt")
        recipe.write_text("\n".join(everything()) + "\n")
        command = ("rtde", "record", host, str(file), "--config", str(recipe), *options)
        with running(HERE.gatewayd(*command)) as recorder:
            time.sleep(SETTLE)
            before, size = usage(recorder.pid), file.stat().st_size
            samples.take(title, recorder.pid, partial(time.sleep, seconds))
            used, written = usage(recorder.pid) - before, file.stat().st_size - size
        gaps = Path(f"{file}.gaps.jsonl")
        missing = len(gaps.read_text().splitlines()) if gaps.exists() else 0
        packages = used.wall * RATE
        return (
            f"{100 * used.cpu / used.wall:.1f} %",
            f"{written / packages:.0f}",
            f"{packages:.0f}",
            str(missing),
        )


def _loops() -> Table:
    table = Table("A control loop", LOOP, ("client", "cycles p50", "p99", "ms p50", "p99"))
    for kind in ("gatewayd", *(["ur_rtde"] if find_spec("rtde_receive") else [])):
        with _robot("--program", "output_int_register_18 = input_int_register_18") as host:
            command = python(CLIENT, "loop", kind, host, str(PORT), str(LOOPS))
            lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
        cycles, times = zip(*(map(float, line.split()) for line in lines), strict=True)
        shown = [percentile(cycles, 0.5), percentile(cycles, 0.99)]
        waited = [1000 * percentile(times, 0.5), 1000 * percentile(times, 0.99)]
        table.add(kind, *(f"{value:.0f}" for value in shown), *(f"{value:.2f}" for value in waited))
    return table
