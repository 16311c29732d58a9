"""What one cell, one connection and one variable more cost, and where that stops being linear."""

from __future__ import annotations

import struct
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

from tests.benchmarks.growth_robots import host
from tests.benchmarks.growth_size import connections, variables
from tests.benchmarks.image import DOUBLES_OUT, INTEGERS_IN, numbers, one_of_many
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port, python, running
from tests.benchmarks.report import Table, at_most, percentile
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.servers import FRESH, ROBOT_STATE
from tests.benchmarks.trees import HERE, Job
from tests.benchmarks.usage import usage
from tests.e2e.processes import Process, wait_for

CELLS = (1, 10, 50)
FREQUENCY = 125
PLC_RATE = 10
"""Times a second that each PLC writes and reads."""
MEMORY_AIM = 150.0
TOLERANCE = 0.2
"""A slope that is greater by more than this is no longer the same line."""
START = 60.0
"""Seconds for fifty cells to be served on a busy machine."""
SETTLE = 2.0

OF_CELLS = f"""\
One process with the full image for each cell, a robot for each at {FREQUENCY} Hz and a PLC at {PLC_RATE} Hz (FC16 of
10, FC3 of 125), all on one listener. Robots are one process, PLCs another. Request: its round trip. Age: of the value
that a PLC gets, from the moment when the robot sent it; up to {1000 / FREQUENCY:g} ms of it are the robot's period.
{RULE}"""


def run(job: Job) -> list[Table]:
    """Three tables."""
    samples = Samples()
    return [_cells(job, samples), connections(job, samples), variables()]


def knee(points: Sequence[tuple[int, float]]) -> str:
    """Up to where a cost grows as between the first two points, which are (number, cost) in order."""
    slopes = [(cost - less) / (count - fewer) for (fewer, less), (count, cost) in pairwise(points)]
    for (count, _), slope in zip(points[1:], slopes[1:], strict=False):
        if slope > (1 + TOLERANCE) * slopes[0]:
            return f"linear up to {count}, then {slope / slopes[0]:.2g} x as much for each more"
    return f"linear up to {points[-1][0]}"


@dataclass(frozen=True, slots=True)
class _Cost:
    """Of a process with so many cells."""

    cells: int
    start: float
    cpu: float
    """Share of a core in percent."""
    megabytes: float
    round_trips: list[float]
    ages: list[float]


def _cells(job: Job, samples: Samples) -> Table:
    header = (
        "cells",
        "CPU",
        "for each",
        "memory",
        "for each",
        "request p50",
        "p99",
        "age p99",
        "fresh after",
    )
    table = Table("Growth: cells in one process", OF_CELLS, (*header, *NOISE))
    costs = []
    for count in CELLS:
        cost = _cost(count, max(job.seconds, 2.0), samples)
        costs.append(cost)
        memory = f"{cost.megabytes:.1f} MB"
        if count == CELLS[-1]:
            memory = at_most(cost.megabytes, MEMORY_AIM, " MB")
        table.add(
            str(count),
            f"{cost.cpu:.2f} %",
            f"{cost.cpu / count:.2f} %",
            memory,
            f"{cost.megabytes / count:.2f} MB",
            f"{percentile(cost.round_trips, 0.5) * 1000:.3f} ms",
            f"{percentile(cost.round_trips, 0.99) * 1000:.3f} ms",
            f"{percentile(cost.ages, 0.99) * 1000:.2f} ms",
            f"{cost.start:.2f} s",
            *samples.noise(f"{count} cells"),
        )
    table.add("CPU:", knee([(one.cells, one.cpu) for one in costs]))
    table.add("memory:", knee([(one.cells, one.megabytes) for one in costs]))
    table.note = samples.note
    return table


def _cost(count: int, seconds: float, samples: Samples) -> _Cost:
    robot, port = free_port(), free_port()
    robots = python("-m", "tests.benchmarks.growth_robots", str(count), str(robot), str(FREQUENCY))
    with tempfile.TemporaryDirectory() as folder, running(robots) as controllers:
        controllers.answer()
        for number in range(count):
            text = one_of_many(number, host(number), robot, port, FREQUENCY)
            Path(folder, f"{number}.yaml").write_text(text)
        begin = time.monotonic()
        with running(HERE.gatewayd("run", folder, "--control", Path(folder, "control")), port) as process:
            plcs = [Plc(port, number + 1) for number in range(count)]
            for plc in plcs:
                wait_for(partial(_is_fresh, plc), "fresh values", START)
            start = time.monotonic() - begin
            time.sleep(SETTLE)
            cost = samples.take(f"{count} cells", process.pid, partial(_work, process, plcs, start, seconds))
            for plc in plcs:
                plc.close()
            return cost


def _is_fresh(plc: Plc) -> bool:
    return plc.read(ROBOT_STATE, 1) == bytes((0, FRESH))


def _work(process: Process, plcs: list[Plc], start: float, seconds: float) -> _Cost:
    """Have the PLCs take turns, so that each of them has PLC_RATE a second."""
    before = usage(process.pid)
    round_trips, ages = [], []
    due = time.monotonic()
    for number in range(round(seconds * PLC_RATE)):
        content = numbers(10, number)
        for plc in plcs:
            due += 1 / PLC_RATE / len(plcs)
            time.sleep(max(0.0, due - time.monotonic()))
            begin = time.monotonic()
            plc.write(INTEGERS_IN, content)
            written = time.monotonic()
            (sent,) = struct.unpack_from(">d", plc.read(DOUBLES_OUT, 125))
            now = time.monotonic()
            round_trips += [written - begin, now - written]
            ages.append(now - sent)
    used = usage(process.pid) - before
    megabytes = process.resident_kilobytes() / 1024
    return _Cost(len(plcs), start, 100 * used.cpu / used.wall, megabytes, round_trips, ages)
