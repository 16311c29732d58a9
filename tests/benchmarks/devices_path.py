"""How long a value is under way between a device and the robot, seen from outside.

The controller and whoever changes the device are this process; gatewayd and the device, a server of libmodbus, are two
others. A change happens at any moment of a poll, so its time is spread evenly over the period and what the way takes.
"""

from __future__ import annotations

import random
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from tests.benchmarks.controller import Controller
from tests.benchmarks.latency import PATIENCE, PERIOD, pace
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port
from tests.benchmarks.report import Table, at_most, percentile
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.servers import Served, mapped_gateway
from tests.benchmarks.trees import Job

POLLS = (0.005, 0.02)
"""Seconds between two reads of the device."""
READ, WRITTEN = "input_int_register_0", "output_int_register_0"
PLACE_READ, PLACE_WRITTEN = 0, 10
ROUNDS = 2
WAY = 0.003
"""Seconds that everything besides the waiting for the next poll may take, in 99 of 100 cases."""
NOTE = f"""\
A register of the device changes at any moment; the controller, in the same process, receives the RTDE package with the
new value. And back: a package has a new value, the register of the device is read until it is there. Loopback and the
device's own time are part of both. Poll: time between two reads of the device; robot at 500 Hz.
{RULE}"""


def mapping(robot: int, port: int, frequency: float, *, device: int, poll: float) -> str:
    """One value each way."""
    return f"""\
gatewayd: 1
cell: benchmark
robot: {{host: 127.0.0.1, port: {robot}, frequency: {frequency:g}}}
modbus: {{listen: "127.0.0.1:{port}"}}
devices:
  island: {{modbus: "127.0.0.1:{device}", poll: {poll * 1000:g}ms, watchdog: none}}
writers:
  island: {{device: island}}
variables:
  read:    {{robot: {READ}, device: {{holding: {PLACE_READ}, type: int32}}, owner: island}}
  written: {{robot: {WRITTEN}, device: {{holding: {PLACE_WRITTEN}, type: int32}}, on_stale: hold, modbus: 100}}
"""


def table(device: int, job: Job) -> Table:
    """Both ways, with each poll period; `device`: port of a server of libmodbus."""
    found = Table(
        "Device to robot, and robot to device",
        NOTE,
        ("way", "poll", "p50", "p99", "greatest", "of", *NOISE),
    )
    samples = Samples()
    seconds = job.seconds / ROUNDS
    for poll in POLLS:
        inward: list[float] = []
        outward: list[float] = []
        with _between(device, poll) as (controller, served):
            island = Plc(device)
            for _ in range(ROUNDS):
                read = partial(_to_robot, controller, island, poll, seconds)
                inward += samples.take(f"to robot {poll}", served.process.pid, read)
                write = partial(_to_device, controller, island, seconds)
                outward += samples.take(f"to device {poll}", served.process.pid, write)
            island.close()
        for way, times, aim in (("to robot", inward, poll + WAY), ("to device", outward, WAY)):
            found.add(way, f"{poll * 1000:g} ms", *_figures(times, aim), *samples.noise(f"{way} {poll}"))
    found.note = samples.note
    return found


@contextmanager
def _between(device: int, poll: float) -> Iterator[tuple[Controller, Served]]:
    """gatewayd between a controller and the device, once a value has come through both ways."""
    robot = free_port()
    controller = Controller(robot)
    image = partial(mapping, device=device, poll=poll)
    with mapped_gateway(robot, image=image) as served:
        controller.wait_for_start()
        island = Plc(device)
        _await(controller, island, 1, lambda: controller.values.get(READ) == (1,))
        island.close()
        yield controller, served
    controller.close()


def _await(controller: Controller, island: Plc, value: int, there: Callable[[], bool]) -> None:
    end = time.monotonic() + 15.0
    island.write(PLACE_READ, struct.pack(">i", value))
    while not there():
        if time.monotonic() > end:
            raise TimeoutError("the device's value does not come to the robot")
        pace(controller, PERIOD)


def _to_robot(controller: Controller, island: Plc, poll: float, seconds: float) -> list[float]:
    """Times from each change in the device to the package with its value."""
    times = []
    last = int(controller.values[READ][0])
    chance = random.Random(last)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        last += 1
        pace(controller, poll + chance.random() * poll)
        begin = time.perf_counter()
        island.write(PLACE_READ, struct.pack(">i", last))
        due = begin + PERIOD
        while controller.values.get(READ) != (last,):
            controller.pump(max(0.0, due - time.perf_counter()))
            if time.perf_counter() >= due:
                controller.send()
                due += PERIOD
            if time.perf_counter() - begin > PATIENCE:
                raise TimeoutError(f"a change of the device did not reach the robot within {PATIENCE:g} s")
        times.append(time.perf_counter() - begin)
    return times


def _to_device(controller: Controller, island: Plc, seconds: float) -> list[float]:
    """Times from each package with a new value to the register of the device that has it."""
    times = []
    last = int(controller.values.get(WRITTEN, (0,))[0])
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        last += 1
        pace(controller, 2 * PERIOD)
        controller.values[WRITTEN] = (last,)
        begin = time.perf_counter()
        controller.send()
        wanted, due = struct.pack(">i", last), begin + PERIOD
        while island.read(PLACE_WRITTEN, 2) != wanted:
            controller.pump(0)
            if time.perf_counter() >= due:
                controller.send()
                due += PERIOD
            if time.perf_counter() - begin > PATIENCE:
                raise TimeoutError(f"a value of the robot did not reach the device within {PATIENCE:g} s")
        times.append(time.perf_counter() - begin)
    return times


def _figures(times: list[float], aim: float) -> tuple[str, str, str, str]:
    p50, p99, greatest = (percentile(times, share) * 1000 for share in (0.5, 0.99, 1.0))
    return f"{p50:.2f} ms", at_most(p99, aim * 1000, " ms"), f"{greatest:.2f} ms", str(len(times))
