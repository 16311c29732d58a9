"""The Modbus client: polls per second and CPU per poll, beside pymodbus's and libmodbus's; and silent units."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median

from tests.benchmarks import devices_path
from tests.benchmarks.compiled import compiled, libmodbus_is_there
from tests.benchmarks.processes import free_port, python, running
from tests.benchmarks.report import Table, against, at_least, at_most
from tests.benchmarks.trees import Job
from tests.peers.programs import compile_libmodbus_server

CLIENT = Path(__file__).with_name("devices_client.py")
ROUNDS = 3
ALL = tuple(range(1, 33))
FOUR_SILENT = (*range(1, 29), 101, 102, 103, 104)
"""The server does not know the last four."""
PROBED = 12.0
"""Seconds in which two of the lost units are probed: one every 20 time-outs."""
WARMUP = 3.0
"""Seconds until those that are silent count as lost."""

SPEED = """\
One connection to a server of libmodbus, one request after the other, each for so many holding registers. Polls per
second, and CPU time of the client's process for each (us). "every 20 ms": with this period, else as fast as it goes."""
SILENCE = """\
32 units behind one connection, each asked for 10 registers, time-out 0.3 s. Polls per second of one unit that answers,
when all do and when four do not. pymodbus: its client without retries, one unit after the other."""


@dataclass(frozen=True, slots=True)
class Polled:
    """What one client has reached."""

    per_second: float
    cpu: float
    """Seconds for each poll."""

    @classmethod
    def of(cls, command: list[str]) -> Polled:
        """That of a client process that prints polls, seconds and CPU seconds."""
        found = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout.split()
        polls, seconds, cpu = (float(word) for word in found)
        return cls(polls / seconds, cpu / max(polls, 1))


def run(job: Job) -> list[Table]:
    """Three tables: speed, silent units, the way of a value to the robot and back."""
    if not libmodbus_is_there():
        return []
    seconds = job.seconds / ROUNDS
    with _server() as port, compiled("devices_client") as yardstick:
        return [_speed(port, yardstick, seconds), _silence(port), devices_path.table(port, job)]


@contextmanager
def _server() -> Iterator[int]:
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        program = compile_libmodbus_server(Path(folder))
        with running([program, "tcp", "127.0.0.1", str(port), str(len(ALL))], port):
            yield port


def _client(
    name: str, port: int, registers: int, *, period: float, seconds: float, units: tuple[int, ...]
) -> Polled:
    warmup = WARMUP if len(units) > 1 else 0.3
    settings = (port, registers, period, 1, warmup, seconds, *units)
    return Polled.of(python(CLIENT, name, *map(str, settings)))


def _middle(found: list[Polled]) -> Polled:
    return Polled(median(one.per_second for one in found), median(one.cpu for one in found))


def _speed(port: int, yardstick: str, seconds: float) -> Table:
    names = ("gatewayd", "pymodbus", "libmodbus")
    header = ["request"]
    for name in names:
        header += [name, "us"]
    table = Table(
        "Polls per second of a Modbus client", SPEED, (*header, "/ pymodbus", "CPU / pymodbus", "/ libmodbus")
    )
    for registers, period in ((10, 0.0), (125, 0.0), (10, 20.0)):
        taken: dict[str, list[Polled]] = {name: [] for name in names}
        for _ in range(ROUNDS):
            for name in names[:2]:
                taken[name].append(_client(name, port, registers, period=period, seconds=seconds, units=(1,)))
            if not period:
                command = [yardstick, str(port), str(registers), str(seconds)]
                taken["libmodbus"].append(Polled.of(command))
        found = {name: _middle(all_of) for name, all_of in taken.items() if all_of}
        cells = [f"FC3 {registers}" + (f" every {period:g} ms" if period else "")]
        for name in names:
            one = found.get(name)
            cells += ["-", "-"] if one is None else [f"{one.per_second:,.0f}", f"{one.cpu * 1e6:.1f}"]
        own, stock = found["gatewayd"], found["pymodbus"]
        cells += [
            "-" if period else against(own.per_second, stock.per_second, at_least, 1.0),
            against(own.cpu, stock.cpu, at_most, 1.0),
            against(own.per_second, found["libmodbus"].per_second, at_least) if "libmodbus" in found else "-",
        ]
        table.add(*cells)
    return table


def _silence(port: int) -> Table:
    table = Table(
        "32 units of which 4 are silent: polls per second of each other unit",
        SILENCE,
        ("client", "period", "all answer", "four are silent", "after / before"),
    )
    for name, aim in (("gatewayd", 0.95), ("pymodbus", None)):
        for period in (100.0, 250.0):
            client = partial(_client, name, port, 10, period=period, seconds=PROBED)
            before = client(units=ALL).per_second / len(ALL)
            after = client(units=FOUR_SILENT).per_second / (len(ALL) - 4)
            table.add(
                name,
                f"{period:g} ms",
                f"{before:,.1f}",
                f"{after:,.1f}",
                against(after, before, at_least, aim),
            )
    return table
