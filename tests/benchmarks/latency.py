"""How long a value is under way, seen from outside: controller and PLC in one process, gatewayd in another."""

from __future__ import annotations

import struct
import time
from collections import deque
from dataclasses import dataclass, field

from tests.benchmarks.controller import Controller
from tests.benchmarks.image import DOUBLES_OUT, INTEGERS_IN
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port
from tests.benchmarks.report import Table, at_most, histogram, percentile
from tests.benchmarks.servers import mapped_gateway

PERIOD = 0.002
"""Seconds between packages: 500 Hz."""
PATIENCE = 2.0
"""Seconds after which a value that is not seen will never be."""
DOUBLES = tuple(f"output_double_register_{number}" for number in range(24))
WORDS = 4
"""Registers of one double."""
BOUNDS = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 1.0, 2.0)
OUT_AIM = 0.3
IN_AIM = 0.5

OUT = """\
The full image's package is handed to the kernel; the PLC, in the same process, then reads one double until
the new value is there. So one Modbus round trip and the loopback are part of it: the gateway's own time is
less."""
IN = """\
The PLC's FC16 request for an integer is handed to the kernel, in the middle of a cycle; the controller, in
the same process, receives the RTDE package with the new value. Loopback both ways is part of it."""


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


def run(seconds: float) -> list[Table]:
    """A table for each direction."""
    robot = free_port()
    controller = Controller(robot)
    with mapped_gateway(robot) as served:
        controller.wait_for_start()
        plc = Plc(served.port)
        pace(controller, 0.5)
        outward = stream(controller, plc, seconds).times
        inward = _inward(controller, plc, seconds)
        plc.close()
    controller.close()
    out = Table("Robot to PLC: package in -> value in the PLC's hands", OUT, ("time", "share", ""))
    _fill(out, outward, OUT_AIM)
    into = Table("PLC to robot: write in -> package out", IN, ("time", "share", ""))
    _fill(into, inward, IN_AIM)
    return [out, into]


def _fill(table: Table, times: list[float], aim: float) -> None:
    table.rows = histogram(times, BOUNDS)
    table.add("p50", f"{percentile(times, 0.5) * 1000:.3f} ms", f"of {len(times)}")
    table.add("p99", at_most(percentile(times, 0.99) * 1000, aim, " ms"))
    table.add("greatest", f"{max(times) * 1000:.3f} ms")


def _inward(controller: Controller, plc: Plc, seconds: float) -> list[float]:
    """Times from each write to the package with its value."""
    times = []
    for number in range(1, int(seconds / PERIOD / 2) + 1):
        pace(controller, PERIOD)
        time.sleep(PERIOD / 2)
        controller.pump(0)
        begin = time.perf_counter()
        plc.post(INTEGERS_IN, struct.pack(">i", number))
        while controller.values.get("input_int_register_0") != (number,):
            controller.pump(PATIENCE)
            if time.perf_counter() - begin > PATIENCE:
                raise TimeoutError(f"a written value did not reach the controller within {PATIENCE:g} s")
        times.append(time.perf_counter() - begin)
        plc.answer()
    return times
