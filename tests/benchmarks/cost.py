"""What the daemon costs with the full image at 500 Hz: CPU time, memory, the time to start."""

from __future__ import annotations

import struct
import time
from statistics import median

from tests.benchmarks.controller import Controller
from tests.benchmarks.image import DOUBLES_OUT, INTEGERS_IN
from tests.benchmarks.latency import PERIOD, pace
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port
from tests.benchmarks.report import Table, at_most
from tests.benchmarks.servers import Served, gateway, mapped_gateway, simulator
from tests.e2e.processes import wait_for

STARTS = 5
SETTLE = 2.0
"""Seconds between the first fresh value and the measurement."""
PLC_PERIOD = 0.01
COUNTERS = 60014
"""Packages, skipped, late: 32 bits each (status block)."""
ROBOT_STATE = 60007
FRESH = b"\x00\x02"
CPU_AIM = 8.0
START_AIM = 0.5
MEMORY_AIM = 60.0

DEFINITION = """\
`gatewayd run` with all reserved registers both ways, read-back of the inputs and 20 state fields, its robot
being `gatewayd simulate` at 500 Hz. CPU: user and system time from /proc, as a share of one core. PLC:
every 10 ms FC3 of 125 registers and FC16 of 10. Skipped: of packages that a controller is known to have
sent, those that a newer one overtook. Start: from fork to the accepted connection, and to fresh values with
a robot that is there; median of five."""


def run(seconds: float) -> list[Table]:
    """One table."""
    table = Table("Cost of the daemon, full image at 500 Hz", DEFINITION, ("what", "figure"))
    seconds = max(seconds, 3.0)
    with gateway() as served:
        time.sleep(SETTLE)
        before = _counters(served)
        table.add("CPU, no PLC", at_most(_share(served, seconds, busy=False), CPU_AIM, " %"))
        table.add("CPU, one PLC", f"{_share(served, seconds, busy=True):.3g} %")
        packages, skipped, late = (now - then for now, then in zip(_counters(served), before, strict=True))
        table.add("packages", f"{packages}; the simulator left out {skipped}, {late} came late")
        table.add("memory (RSS)", at_most(served.process.resident_kilobytes() / 1024, MEMORY_AIM, " MB"))
    sent, overtaken = _skipped(seconds)
    table.add("packages gatewayd skipped", f"{at_most(overtaken, 0)} of {sent}")
    table.add("start to serving", at_most(median(_start() for _ in range(STARTS)), START_AIM, " s"))
    with simulator() as robot:
        table.add("start to fresh values", f"{median(_start(robot.port) for _ in range(STARTS)):.3g} s")
    return [table]


def _skipped(seconds: float) -> tuple[int, int]:
    """Packages that a controller sent at 500 Hz, and how many of them the daemon skipped for newer ones."""
    robot = free_port()
    controller = Controller(robot)
    with mapped_gateway(robot) as served:
        controller.wait_for_start()
        pace(controller, 0.1)
        before = _counters(served)[0]
        pace(controller, seconds)
        time.sleep(0.1)
        counted = _counters(served)[0] - before
    controller.close()
    sent = round(seconds / PERIOD)
    return sent, sent - counted


def _share(served: Served, seconds: float, *, busy: bool) -> float:
    """CPU time in percent of one core, while nobody asks or while a PLC does."""
    begin, used = time.monotonic(), served.process.cpu_seconds()
    if busy:
        _poll(served.port, begin + seconds)
    else:
        time.sleep(seconds)
    return 100 * (served.process.cpu_seconds() - used) / (time.monotonic() - begin)


def _poll(port: int, end: float) -> None:
    plc = Plc(port)
    number = 0
    while time.monotonic() < end:
        number += 1
        plc.read(DOUBLES_OUT, 125)
        plc.write(INTEGERS_IN, struct.pack(">5i", *[number] * 5))
        time.sleep(PLC_PERIOD)
    plc.close()


def _counters(served: Served) -> tuple[int, ...]:
    plc = Plc(served.port)
    counters = struct.unpack(">3I", plc.read(COUNTERS, 6))
    plc.close()
    return counters


def _start(robot: int | None = None) -> float:
    """Seconds until the daemon serves; with a robot's port: until its values are fresh."""
    begin = time.monotonic()
    with mapped_gateway(robot or free_port()) as served:
        if robot is not None:
            plc = Plc(served.port)
            wait_for(lambda: plc.read(ROBOT_STATE, 1) == FRESH, "fresh values")
            plc.close()
        return time.monotonic() - begin
