"""The servers that are compared, each as a process: libmodbus's in C, pymodbus's own, and gatewayd with a robot."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.compiled import compiled
from tests.benchmarks.image import everything_on, full_image
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port, python, running
from tests.benchmarks.trees import HERE, Tree
from tests.e2e.processes import Process, wait_for

COUNTERS = 60014
"""Address of packages, skipped and late in the status block, 32 bits each."""
ROBOT_STATE = 60007
FRESH = 2
"""`robot_state` of the status block: packages come and tell something new."""


@dataclass(frozen=True, slots=True)
class Served:
    """A running server."""

    process: Process
    port: int


@contextmanager
def libmodbus() -> Iterator[Served]:
    """libmodbus's server over 1000 registers."""
    port = free_port()
    with compiled("modbus_server") as program, running([program, str(port)], port) as process:
        yield Served(process, port)


@contextmanager
def c_gateway(robot: int) -> Iterator[Served]:
    """The gateway in C; its robot has to be there, and to answer while this waits."""
    port = free_port()
    with compiled("gateway") as program, running([program, str(robot), str(port)]) as process:
        yield Served(process, port)


@contextmanager
def stock() -> Iterator[Served]:
    """pymodbus's server over 1000 registers."""
    port = free_port()
    with running(python(Path(__file__).with_name("stock_server.py"), str(port)), port) as process:
        yield Served(process, port)


@contextmanager
def simulator(frequency: float = 500) -> Iterator[Served]:
    """gatewayd's simulated controller, always this tree's."""
    port = free_port()
    options = ("--port", str(port), "--frequency", f"{frequency:g}")
    with running(HERE.gatewayd("simulate", *options), port) as process:
        yield Served(process, port)


@contextmanager
def mapped_gateway(
    robot: int,
    frequency: float = 500,
    *,
    tree: Tree = HERE,
    image: Callable[[int, int, float], str] = full_image,
    audit: bool = False,
) -> Iterator[Served]:
    """`gatewayd run` with the image, listening; the robot may or may not be there."""
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        mapping = Path(folder) / "benchmark.yaml"
        mapping.write_text(image(robot, port, frequency))
        options: tuple[str | Path, ...] = ("--control", Path(folder) / "control")
        if audit:
            options += ("--audit", Path(folder) / "audit")
        with running(tree.gatewayd("run", mapping, *options), port) as process:
            yield Served(process, port)


@contextmanager
def gateway(frequency: float = 500, *, tree: Tree = HERE) -> Iterator[Served]:
    """`gatewayd run` with the full image and a simulated robot whose values are fresh."""
    with simulator() as robot, mapped_gateway(robot.port, frequency, tree=tree) as served:
        await_fresh(served.port)
        yield served


@contextmanager
def whole_gateway(*, tree: Tree = HERE) -> Iterator[Served]:
    """`gateway` with everything on that a request can meet, at 500 Hz."""
    with (
        simulator() as robot,
        mapped_gateway(robot.port, tree=tree, image=everything_on, audit=True) as served,
    ):
        await_fresh(served.port)
        yield served


def await_fresh(port: int) -> None:
    """Wait until the robot's values are."""
    plc = Plc(port)
    wait_for(lambda: plc.read(ROBOT_STATE, 1) == bytes((0, FRESH)), "the robot's values to be fresh")
    plc.close()


def counters(port: int) -> tuple[int, int, int]:
    """Packages that were shown, that the controller left out, and that came late."""
    plc = Plc(port)
    packages, skipped, late = struct.unpack(">3I", plc.read(COUNTERS, 6))
    plc.close()
    return packages, skipped, late
