"""gatewayd beside the script that a user would write instead, fed by the same controller at 500 Hz."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

from tests.benchmarks.controller import Controller
from tests.benchmarks.image import DOUBLES_OUT
from tests.benchmarks.latency import pace, stream
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port, listens, python, running
from tests.benchmarks.report import Table, percentile
from tests.benchmarks.servers import Served, mapped_gateway
from tests.benchmarks.trees import Job
from tests.benchmarks.usage import usage

ROBOT_PORT = 30004
"""ur_rtde knows no other, so the controller gets a loopback address of its own."""
ROBOT_HOST = "127.0.0.3"
FIRST = DOUBLES_OUT + 4 * 12
"""Address of `output_double_register_12`, the first that ur_rtde gives."""
DOUBLES = 8
SILENCE = 3.0
"""Seconds for which the controller says nothing while its connection stays open."""

LAG = 0.04
"""Seconds in which even a slow server shows the last package."""

DEFINITION = """\
Every double is the same number in each package; the PLC reads eight of them in one request, after each
package and then without a pause. The script maps 16 registers outward and nothing else; gatewayd serves the
full image, inward and read-back too. Mixed: a block with doubles of two packages. Silence: the controller
stops sending but keeps its connection, as behind a dead switch; how long until the registers tell."""


def run(job: Job) -> list[Table]:
    """One table; only gatewayd's column where ur_rtde has no wheel."""
    columns = {"gatewayd": _column_of_gatewayd(job.seconds)}
    if find_spec("rtde_receive") is not None:
        columns["script"] = _column_of_script(job.seconds)
    table = Table("Beside the script that a user would write", DEFINITION, ("what", *columns))
    for what in columns["gatewayd"]:
        table.add(what, *(column[what] for column in columns.values()))
    return [table]


def _column_of_gatewayd(seconds: float) -> dict[str, str]:
    port = free_port()
    controller = Controller(port)
    with mapped_gateway(port) as served:
        controller.wait_for_start()
        return _column(controller, served, seconds)


def _column_of_script(seconds: float) -> dict[str, str]:
    controller = Controller(ROBOT_PORT, ROBOT_HOST)
    with _script(controller) as served:
        return _column(controller, served, seconds)


@contextmanager
def _script(controller: Controller) -> Iterator[Served]:
    """The script as a process; it listens only after its robot has sent something."""
    port = free_port()
    with running(python(Path(__file__).with_name("user_script.py"), ROBOT_HOST, str(port))) as process:
        controller.wait_for_start()
        while process.running and not listens(port):
            pace(controller, 0.02)
        yield Served(process, port)


def _column(controller: Controller, served: Served, seconds: float) -> dict[str, str]:
    plc = Plc(served.port)
    pace(controller, 1.0)
    before = usage(served.process.pid)
    pace(controller, seconds)
    used = usage(served.process.pid) - before
    cpu = 100 * used.cpu / used.wall
    seen = stream(controller, plc, seconds, first=FIRST, count=DOUBLES)
    hammered = stream(controller, plc, seconds, first=FIRST, count=DOUBLES, hammer=True)
    silence = _silence(controller, plc)
    plc.close()
    controller.close()
    return {
        "CPU of one core, no PLC": f"{cpu:.3g} %",
        "package to PLC, p50": f"{percentile(seen.times, 0.5) * 1000:.3f} ms",
        "package to PLC, p99": f"{percentile(seen.times, 0.99) * 1000:.3f} ms",
        "mixed blocks": f"{hammered.mixed} of {hammered.reads}",
        "silence told after": "never" if silence is None else f"{silence * 1000:.0f} ms",
    }


def _silence(controller: Controller, plc: Plc) -> float | None:
    """Seconds of silence until the PLC reads something else than the last value; None: it never does."""
    pace(controller, 0.1)
    begin = time.monotonic()
    time.sleep(LAG)
    last = plc.read(FIRST, 4)
    while time.monotonic() - begin < SILENCE:
        controller.pump(0)
        if plc.read(FIRST, 4) != last:
            return time.monotonic() - begin
        time.sleep(0.001)
    return None
