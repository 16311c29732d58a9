"""What the daemon costs with the full image at 500 Hz: CPU time, memory, packages."""

from __future__ import annotations

import struct
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from statistics import median

from tests.benchmarks.image import DOUBLES_OUT, INTEGERS_IN
from tests.benchmarks.latency import C_GATEWAY, contenders
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import listens
from tests.benchmarks.report import Table, against, at_most
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.servers import Served, await_fresh, counters, simulator
from tests.benchmarks.trees import Job
from tests.benchmarks.usage import usage
from tests.e2e.processes import wait_for

ROUNDS = 3
SETTLE = 2.0
"""Seconds between the first fresh value and the measurement."""
PLC_PERIOD = 0.01
CPU_AIM = 8.0
C_AIM = 4.0
"""Greatest multiple of the CPU time of the gateway in C."""
MEMORY_AIM = 60.0

DEFINITION = f"""\
`gatewayd run` with all reserved registers both ways, read-back of the inputs and 20 state fields, its robot being
`gatewayd simulate` at 500 Hz; gateway.c with the same image beside it. CPU time as a share of one core, median of
{ROUNDS} rounds in which they take turns. PLC: every 10 ms FC3 of 125 registers and FC16 of 10 with new values.
{RULE}"""


def run(job: Job) -> list[Table]:
    """One table."""
    samples = Samples()
    seconds = max(job.seconds, 3.0) / ROUNDS
    with ExitStack() as stack:
        served = {name: stack.enter_context(_connected(name, job)) for name in contenders(job)}
        time.sleep(SETTLE)
        before = {tree.name: counters(served[tree.name].port) for tree in job.trees}
        idle, busy = _shares(served, seconds, samples)
        columns = ("what", *served, *(f"/ {name}" for name in list(served)[1:]), *NOISE)
        table = Table("Cost of the daemon, full image at 500 Hz", DEFINITION, columns)
        _add_cpu(table, "CPU, no PLC", idle, samples, CPU_AIM)
        _add_cpu(table, "CPU, one PLC", busy, samples)
        cells = []
        for tree in job.trees:
            now = counters(served[tree.name].port)
            packages, skipped, late = (one - then for one, then in zip(now, before[tree.name], strict=True))
            cells.append(f"{packages}; left out by the simulator {skipped}, late {late}")
        table.add("packages", *cells)
        memory = {name: one.process.resident_kilobytes() / 1024 for name, one in served.items()}
        names = list(memory)
        table.add(
            "memory (RSS)",
            at_most(memory[names[0]], MEMORY_AIM, " MB"),
            *(f"{memory[name]:.3g} MB" for name in names[1:]),
        )
    table.note = samples.note
    return [table]


@contextmanager
def _connected(name: str, job: Job) -> Iterator[Served]:
    """A gateway that shows values of a simulated robot of its own."""
    with simulator() as robot, contenders(job)[name](robot.port) as served:
        wait_for(lambda: listens(served.port), "the gateway to listen")
        if name != C_GATEWAY:
            await_fresh(served.port)
        yield served


def _shares(served: dict[str, Served], seconds: float, samples: Samples) -> list[dict[str, float]]:
    """CPU time in percent of one core, without a PLC and with one; the servers take turns."""
    shares: list[dict[str, list[float]]] = [{name: [] for name in served} for _ in range(2)]
    for _ in range(ROUNDS):
        for busy, found in enumerate(shares):
            for name, one in served.items():
                measure = partial(_share, one, seconds, busy=bool(busy))
                found[name].append(
                    samples.take("CPU, one PLC" if busy else "CPU, no PLC", one.process.pid, measure)
                )
    return [{name: median(values) for name, values in found.items()} for found in shares]


def _add_cpu(
    table: Table, title: str, shares: dict[str, float], samples: Samples, aim: float | None = None
) -> None:
    own, *others = shares
    first = f"{shares[own]:.3g} %" if aim is None else at_most(shares[own], aim, " %")
    ratios = [
        against(shares[own], shares[name], at_most, C_AIM if name == C_GATEWAY else None) for name in others
    ]
    table.add(title, first, *(f"{shares[name]:.3g} %" for name in others), *ratios, *samples.noise(title))


def _share(served: Served, seconds: float, *, busy: bool) -> float:
    """CPU time in percent of one core, while nobody asks or while a PLC does."""
    before = usage(served.process.pid)
    if busy:
        _poll(served.port, time.monotonic() + seconds)
    else:
        time.sleep(seconds)
    used = usage(served.process.pid) - before
    return 100 * used.cpu / used.wall


def _poll(port: int, end: float) -> None:
    plc = Plc(port)
    number = 0
    while time.monotonic() < end:
        number += 1
        plc.read(DOUBLES_OUT, 125)
        plc.write(INTEGERS_IN, struct.pack(">5i", *[number] * 5))
        time.sleep(PLC_PERIOD)
    plc.close()
