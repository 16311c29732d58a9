"""What one connection and one variable more cost; part of the subject `growth`."""

from __future__ import annotations

import resource
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from itertools import cycle
from pathlib import Path
from statistics import median

from tests.benchmarks.image import DOUBLES_OUT, doubles, one_of_many
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import HOST, free_port, running
from tests.benchmarks.report import Table, percentile
from tests.benchmarks.samples import NOISE, Samples
from tests.benchmarks.servers import await_fresh, simulator
from tests.benchmarks.trees import HERE, Job
from tests.benchmarks.usage import usage
from tests.e2e.processes import Process, wait_for

CONNECTIONS = (1, 100, 1000)
PER_SECOND = 500
"""Requests, over all connections."""
VARIABLES = (64, 256, 1024)
FREQUENCY = 125
REQUESTS = 500
REPEATS = 3

OF_CONNECTIONS = f"""\
One cell with the full image and a robot at {FREQUENCY} Hz; so many connections are open and take turns: {PER_SECOND}
requests (FC3 of 10) a second over all of them. CPU: share of a core."""
OF_VARIABLES = f"""\
One cell with so many doubles of a robot at {FREQUENCY} Hz. Whole commands, with the start of their interpreter; reload:
of the file as it is. Request: FC3 of 125 registers on one connection, median of {REQUESTS}. The others: median of
{REPEATS}."""


def connections(job: Job, samples: Samples) -> Table:
    """One process and more and more connections to it."""
    table = Table(
        "Growth: connections", OF_CONNECTIONS, ("open", "request p50", "p99", "CPU", "memory", *NOISE)
    )
    port = free_port()
    with tempfile.TemporaryDirectory() as folder, simulator(FREQUENCY) as robot:
        mapping = Path(folder, "many.yaml")
        mapping.write_text(one_of_many(0, HOST, robot.port, port, FREQUENCY))
        command = HERE.gatewayd("run", mapping, "--control", Path(folder, "control"))
        with _many_files(), running(command, port) as process, ExitStack() as stack:
            await_fresh(port)
            plcs: list[Plc] = []
            for count in CONNECTIONS:
                while len(plcs) < count:
                    plcs.append(Plc(port))
                    stack.callback(plcs[-1].close)
                take = partial(_take_turns, process, plcs, job.seconds)
                times, cpu = samples.take(f"{count} connections", process.pid, take)
                table.add(
                    str(count),
                    f"{percentile(times, 0.5) * 1000:.3f} ms",
                    f"{percentile(times, 0.99) * 1000:.3f} ms",
                    f"{cpu:.2f} %",
                    f"{process.resident_kilobytes() / 1024:.1f} MB",
                    *samples.noise(f"{count} connections"),
                )
    table.note = samples.note
    return table


def variables() -> Table:
    """One process for each number of them."""
    header = ("variables", "check", "start", "reload", "request", "CPU", "memory", "after reloads")
    table = Table("Growth: variables", OF_VARIABLES, header)
    with simulator(FREQUENCY) as robot:
        for count in VARIABLES:
            table.add(str(count), *_sized(count, robot.port))
    return table


def _sized(count: int, robot: int) -> list[str]:
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        mapping, control = Path(folder, "sized.yaml"), Path(folder, "control")
        mapping.write_text(doubles(count, robot, port, FREQUENCY))
        check = _median(partial(_time, HERE.gatewayd("check", mapping)))
        command = HERE.gatewayd("run", mapping, "--control", control)
        start = _median(partial(_start, command, port))
        with running(command, port) as process:
            await_fresh(port)
            wait_for(control.exists, "the control socket")
            memory = process.resident_kilobytes() / 1024
            reload = _median(partial(_time, HERE.gatewayd("reload", "--socket", control)))
            plc = Plc(port)
            before = usage(process.pid)
            time.sleep(1.0)
            used = usage(process.pid) - before
            request = median(_round_trip(plc, 0, 125) for _ in range(REQUESTS))
            plc.close()
            return [
                f"{check:.3f} s",
                f"{start:.3f} s",
                f"{reload:.3f} s",
                f"{request * 1000:.3f} ms",
                f"{100 * used.cpu / used.wall:.2f} %",
                f"{memory:.1f} MB",
                f"{process.resident_kilobytes() / 1024:.1f} MB",
            ]


@contextmanager
def _many_files() -> Iterator[None]:
    """Let this process, and what it starts, have as many open files as the system allows it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def _take_turns(process: Process, plcs: list[Plc], seconds: float) -> tuple[list[float], float]:
    """Round trips, and the CPU time of the server in percent of one core."""
    before = usage(process.pid)
    times = []
    due = time.monotonic()
    for _, plc in zip(range(round(seconds * PER_SECOND)), cycle(plcs), strict=False):
        due += 1 / PER_SECOND
        time.sleep(max(0.0, due - time.monotonic()))
        times.append(_round_trip(plc, DOUBLES_OUT, 10))
    used = usage(process.pid) - before
    return times, 100 * used.cpu / used.wall


def _round_trip(plc: Plc, first: int, count: int) -> float:
    begin = time.perf_counter()
    plc.read(first, count)
    return time.perf_counter() - begin


def _time(command: list[str]) -> float:
    begin = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begin


def _start(command: list[str], port: int) -> float:
    begin = time.perf_counter()
    with running(command, port):
        return time.perf_counter() - begin


def _median(measure: Callable[[], float]) -> float:
    return median(measure() for _ in range(REPEATS))
