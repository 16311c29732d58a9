"""How long a value is under way, seen from outside: controller and PLC in one process, gatewayd in another."""

from __future__ import annotations

import struct
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import partial

from tests.benchmarks.compiled import libmodbus_is_there
from tests.benchmarks.controller import Controller
from tests.benchmarks.image import DOUBLES_OUT, INTEGERS_IN
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port, listens
from tests.benchmarks.report import Table, against, at_most, histogram, percentile
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.servers import Served, c_gateway, mapped_gateway
from tests.benchmarks.trees import Job

PERIOD = 0.002
"""Seconds between packages: 500 Hz."""
PATIENCE = 2.0
"""Seconds after which a value that is not seen will never be."""
DOUBLES = tuple(f"output_double_register_{number}" for number in range(24))
WRITTEN = "input_int_register_0"
WORDS = 4
"""Registers of one double."""
BOUNDS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 1.0, 2.0)
OUT_AIM = 0.3
IN_AIM = 0.5
ROUNDS = 3
C_GATEWAY = "in C"
Gateway = Callable[[int], AbstractContextManager[Served]]
"""Starts a gateway for the robot on this port."""

OUT = f"""\
The full image's package is handed to the kernel; the PLC, in the same process, then reads one double until the new
value is there. So one Modbus round trip and the loopback are part of it: the gateway's own time is less. In C:
gateway.c, what an integrator would write with libmodbus, without owners, limits and freshness. {ROUNDS} rounds in which
they take turns.
{RULE}"""
IN = """\
The PLC's FC16 request for an integer is handed to the kernel, in the middle of a cycle; the controller, in the same
process, receives the RTDE package with the new value. Loopback both ways is part of it."""


@dataclass
class Stream:
    """What a PLC saw of a controller's packages."""

    times: list[float] = field(default_factory=list)
    """Seconds from handing over each package to the answer that shows it, or a later one."""
    reads: int = 0
    mixed: int = 0
    """Reads in which the doubles were not all of one package."""


def stream(
    controller: Controller,
    plc: Plc,
    seconds: float,
    *,
    first: int = DOUBLES_OUT,
    count: int = 1,
    hammer: bool = False,
) -> Stream:
    """Send numbered packages at 500 Hz and read `count` doubles from register `first` on until each is seen.

    With `hammer` the reading never pauses.
    """
    seen = Stream()
    unseen: deque[tuple[float, float]] = deque()
    layout = struct.Struct(f">{count}d")
    clock = time.perf_counter
    number = controller.values.get(DOUBLES[0], (0.0,))[0]
    due = clock()
    end = due + seconds
    while due < end or unseen:
        if due < end and clock() >= due:
            number += 1.0
            _send(controller, number)
            unseen.append((number, clock()))
            due += PERIOD
        if unseen and clock() - unseen[0][1] > PATIENCE:
            raise TimeoutError(f"a package was not seen within {PATIENCE:g} s")
        if unseen or hammer:
            values = layout.unpack(plc.read(first, WORDS * count))
            now = clock()
            seen.reads += 1
            seen.mixed += len(set(values)) > 1
            while unseen and unseen[0][0] <= values[0]:
                seen.times.append(now - unseen.popleft()[1])
        else:
            time.sleep(max(0.0, due - clock()))
    return seen


def pace(controller: Controller, seconds: float) -> None:
    """Send numbered packages at 500 Hz and do nothing else."""
    number = controller.values.get(DOUBLES[0], (0.0,))[0]
    due = time.perf_counter()
    for _ in range(round(seconds / PERIOD)):
        number += 1.0
        _send(controller, number)
        due += PERIOD
        time.sleep(max(0.0, due - time.perf_counter()))


def _send(controller: Controller, number: float) -> None:
    controller.pump(0)
    controller.values.update(dict.fromkeys(DOUBLES, (number,)))
    controller.send()


def run(job: Job) -> list[Table]:
    """A table for each direction."""
    samples = Samples()
    gateways = contenders(job)
    outward: dict[str, list[float]] = {name: [] for name in gateways}
    inward: dict[str, list[float]] = {name: [] for name in gateways}
    for _ in range(ROUNDS):
        for name, start in gateways.items():
            with fed(start) as (controller, served):
                plc, pid = Plc(served.port), served.process.pid
                pace(controller, 0.5)
                measure = partial(stream, controller, plc, job.seconds / ROUNDS)
                outward[name] += samples.take(f"out {name}", pid, measure).times
                write = partial(_inward, controller, plc, job.seconds / ROUNDS)
                inward[name] += samples.take(f"in {name}", pid, write)
                plc.close()
    columns = ("time", *gateways, *(f"/ {name}" for name in list(gateways)[1:]))
    if len(gateways) == 1:
        columns += ("",)
    out = Table("Robot to PLC: package in -> value in the PLC's hands", OUT, columns)
    _fill(out, "out", outward, OUT_AIM, samples)
    into = Table("PLC to robot: write in -> package out", IN, columns)
    _fill(into, "in", inward, IN_AIM, samples)
    return [out, into]


def contenders(job: Job) -> dict[str, Gateway]:
    """What can stand between robot and PLC, by name, and how it is started for the robot on a port."""
    found: dict[str, Gateway] = {tree.name: partial(mapped_gateway, tree=tree) for tree in job.trees}
    if libmodbus_is_there():
        found[C_GATEWAY] = c_gateway
    return found


@contextmanager
def fed(start: Gateway) -> Iterator[tuple[Controller, Served]]:
    """A gateway and its controller, which has sent something already."""
    robot = free_port()
    controller = Controller(robot)
    with start(robot) as served:
        controller.wait_for_start()
        while not listens(served.port):
            pace(controller, PERIOD)
        yield controller, served
    controller.close()


def _fill(table: Table, key: str, times: dict[str, list[float]], aim: float, samples: Samples) -> None:
    own, *others = times
    for title, share, limit, multiple in (("p50", 0.5, None, 1.5), ("p99", 0.99, aim, 2.0)):
        found = {name: percentile(values, share) * 1000 for name, values in times.items()}
        judged = f"{found[own]:.3f} ms" if limit is None else at_most(found[own], limit, " ms")
        ratios = [
            against(found[own], found[name], at_most, multiple if name == C_GATEWAY else None)
            for name in others
        ]
        table.add(title, judged, *(f"{found[name]:.3f} ms" for name in others), *ratios)
    table.add("greatest", *(f"{max(values) * 1000:.3f} ms" for values in times.values()))
    table.add("of", *(str(len(values)) for values in times.values()))
    for number, title in enumerate(NOISE):
        table.add(title, *(samples.noise(f"{key} {name}")[number] for name in times))
    shares = {name: histogram(values, BOUNDS) for name, values in times.items()}
    for number, (bound, _, bar) in enumerate(shares[own]):
        table.add(bound, *(rows[number][1] for rows in shares.values()), bar)
    table.note = samples.note


def _inward(controller: Controller, plc: Plc, seconds: float) -> list[float]:
    """Times from each write to the package with its value."""
    times = []
    last = int(controller.values.get(WRITTEN, (0,))[0])
    for number in range(last + 1, last + 1 + int(seconds / PERIOD / 2)):
        pace(controller, PERIOD)
        time.sleep(PERIOD / 2)
        controller.pump(0)
        begin = time.perf_counter()
        plc.post(INTEGERS_IN, struct.pack(">i", number))
        while controller.values.get(WRITTEN) != (number,):
            controller.pump(PATIENCE)
            if time.perf_counter() - begin > PATIENCE:
                raise TimeoutError(f"a written value did not reach the controller within {PATIENCE:g} s")
        times.append(time.perf_counter() - begin)
        plc.answer()
    return times
