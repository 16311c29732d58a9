"""Packages of the robot that never were in the image: lost, or overtaken by newer ones."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

from tests.benchmarks.controller import Controller
from tests.benchmarks.latency import PERIOD, pace
from tests.benchmarks.processes import free_port
from tests.benchmarks.report import Table, at_most
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.servers import counters, mapped_gateway
from tests.benchmarks.trees import Job, Tree

BURST = 16
"""Packages of one segment."""
BETWEEN = 50
"""Packages sent one by one before each burst."""
BURSTS = 20
SHOWN = 0.2
"""Seconds after the last package in which all of them are shown."""

DEFINITION = f"""\
Of packages that a controller is known to have sent at 500 Hz, those that never were in the image. One by one; and
{BURSTS} times {BURST} in one segment, as they come after a moment in which the gateway had no CPU.
{RULE}"""


def run(job: Job) -> list[Table]:
    """One table."""
    samples = Samples()
    table = Table("Packages that were not shown", DEFINITION, ("sent", *job.names, *NOISE))
    for title, send in (("one by one", partial(pace, seconds=job.seconds)), ("in bursts", _bursts)):
        found = [_not_shown(tree, title, send, samples) for tree in job.trees]
        table.add(title, *found, *samples.noise(title))
    table.note = samples.note
    return [table]


def _bursts(controller: Controller) -> None:
    for _ in range(BURSTS):
        pace(controller, BETWEEN * PERIOD)
        time.sleep(BURST * PERIOD)
        controller.burst([{}] * BURST, PERIOD)


def _not_shown(tree: Tree, title: str, send: Callable[[Controller], None], samples: Samples) -> str:
    robot = free_port()
    controller = Controller(robot)
    with mapped_gateway(robot, tree=tree) as served:
        controller.wait_for_start()
        pace(controller, 0.5)

        def count() -> tuple[int, int]:
            sent, shown = controller.sent, counters(served.port)[0]
            send(controller)
            time.sleep(SHOWN)
            return controller.sent - sent, counters(served.port)[0] - shown

        sent, shown = samples.take(title, served.process.pid, count)
    controller.close()
    return f"{at_most(sent - shown, 0)} of {sent}"
