"""Start and `gatewayd check`, as multiples of the time of an empty Python on the same machine at the same time."""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median

from tests.benchmarks.image import full_image
from tests.benchmarks.processes import free_port
from tests.benchmarks.report import Table, at_most
from tests.benchmarks.servers import await_fresh, mapped_gateway, simulator
from tests.benchmarks.trees import Job, Tree

ROUNDS = 7
EMPTY = "python -c pass"
HELP = "gatewayd --help"
CHECK = "gatewayd check, full image"
SERVING = "start to serving"
AIMS = {HELP: (5.0, None), CHECK: (14.0, 0.3), SERVING: (18.0, 0.5)}
"""Greatest multiple of EMPTY, and seconds."""
FRESH = "start to fresh values"

DEFINITION = f"""\
Wall-clock time of whole processes: median of {ROUNDS} rounds, in each of which every command has its turn. The
interpreter's own start is part of each of them, and the unit: x. Start: from fork to the accepted connection, and to
fresh values with a robot that is there."""


def run(job: Job) -> list[Table]:
    """One table; a command takes as long as it takes, whatever the job says."""
    with tempfile.TemporaryDirectory() as folder, simulator() as robot:
        mapping = Path(folder) / "full.yaml"
        mapping.write_text(full_image(30004, 1502))
        commands = {
            (what, tree.name): command
            for tree in job.trees
            for what, command in _commands(tree, mapping, robot.port).items()
        }
        times: dict[tuple[str, str], list[float]] = {key: [] for key in commands}
        for _ in range(ROUNDS):
            for key, command in commands.items():
                times[key].append(command())
    columns = [column for name in job.names for column in (name, "multiple")]
    table = Table("Start and check", DEFINITION, ("command", *columns))
    for what in (EMPTY, *AIMS, FRESH):
        cells = []
        for name in job.names:
            found, unit = median(times[what, name]), median(times[EMPTY, name])
            multiple, limit = AIMS.get(what, (None, None))
            cells.append(at_most(found, limit, " s") if limit is not None else f"{found:.3g} s")
            cells.append(at_most(found / unit, multiple, " x") if multiple else f"{found / unit:.3g} x")
        table.add(what, *cells)
    return [table]


def _commands(tree: Tree, mapping: Path, robot: int) -> dict[str, Callable[[], float]]:
    return {
        EMPTY: partial(_time, tree.command("-c", "pass")),
        HELP: partial(_time, tree.gatewayd("--help")),
        CHECK: partial(_time, tree.gatewayd("check", mapping)),
        SERVING: partial(_start, tree, free_port()),
        FRESH: partial(_start, tree, robot, fresh=True),
    }


def _time(command: list[str]) -> float:
    begin = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - begin


def _start(tree: Tree, robot: int, *, fresh: bool = False) -> float:
    """Seconds until the daemon serves, or until its values are fresh."""
    begin = time.perf_counter()
    with mapped_gateway(robot, tree=tree) as served:
        if fresh:
            await_fresh(served.port)
        return time.perf_counter() - begin
