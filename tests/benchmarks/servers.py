"""The servers that are compared, each as a process: libmodbus's in C, pymodbus's own, and gatewayd with a robot."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.image import full_image
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port, gatewayd, python, running
from tests.e2e.processes import Process, wait_for

HERE = Path(__file__).parent
FRESH = 2
"""`robot_state` of the status block: packages come and tell something new."""


@dataclass(frozen=True, slots=True)
class Served:
    """A running server."""

    process: Process
    port: int


def libmodbus_is_there() -> bool:
    """Whether a C compiler and libmodbus's headers can be found."""
    compiler = shutil.which("cc")
    if compiler is None:
        return False
    source = b"#include <modbus.h>\nint main(void) { return 0; }"
    found = subprocess.run(
        [compiler, "-I/usr/include/modbus", "-xc", "-fsyntax-only", "-"],
        input=source,
        capture_output=True,
        check=False,
    )
    return found.returncode == 0


@contextmanager
def libmodbus() -> Iterator[Served]:
    """libmodbus's server over 1000 registers, compiled on the spot."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "modbus_server"
        source = HERE / "modbus_server.c"
        subprocess.run(["cc", "-O2", "-I/usr/include/modbus", "-o", program, source, "-lmodbus"], check=True)
        port = free_port()
        with running([str(program), str(port)], port) as process:
            yield Served(process, port)


@contextmanager
def stock() -> Iterator[Served]:
    """pymodbus's server over 1000 registers."""
    port = free_port()
    with running(python(HERE / "stock_server.py", str(port)), port) as process:
        yield Served(process, port)


@contextmanager
def simulator(frequency: float = 500) -> Iterator[Served]:
    """gatewayd's simulated controller."""
    port = free_port()
    with running(gatewayd("simulate", "--port", str(port), "--frequency", f"{frequency:g}"), port) as process:
        yield Served(process, port)


@contextmanager
def mapped_gateway(robot: int, frequency: float = 500) -> Iterator[Served]:
    """`gatewayd run` with the full image, listening; the robot may or may not be there."""
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        mapping = Path(folder) / "benchmark.yaml"
        mapping.write_text(full_image(robot, port, frequency))
        with running(gatewayd("run", mapping), port) as process:
            yield Served(process, port)


@contextmanager
def gateway(frequency: float = 500) -> Iterator[Served]:
    """`gatewayd run` with the full image and a simulated robot whose values are fresh."""
    with simulator() as robot, mapped_gateway(robot.port, frequency) as served:
        plc = Plc(served.port)
        wait_for(lambda: plc.read(60007, 1) == bytes((0, FRESH)), "the robot's values to be fresh")
        plc.close()
        yield served
