"""Modbus requests per second and round trips, beside libmodbus's C server and the stock pymodbus server."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from statistics import median

from tests.benchmarks.compiled import libmodbus_is_there
from tests.benchmarks.image import DOUBLES_OUT, INTEGERS_IN, WRITABLE, numbers
from tests.benchmarks.load import (
    VARIETY,
    Load,
    Request,
    measure,
    reading,
    writing,
    writing_and_reading,
    writing_coils,
)
from tests.benchmarks.report import Table, against, at_least, at_most
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.servers import Served, gateway, libmodbus, stock, whole_gateway
from tests.benchmarks.trees import Job

QUIET = 10
"""Packages per second of the robot where a row is about Modbus alone."""
ROUNDS = 3
"""Runs of each server in turn; the medians count."""
CONNECTIONS = (1, 16)
OTHERS = ("libmodbus", "stock")
P99_AIM = 1.5


@dataclass(frozen=True, slots=True)
class Row:
    """A request, and the aims for it."""

    request: Request
    whole: bool = False
    """To the mapping with everything on."""
    libmodbus: float | None = None
    """Least share of libmodbus's requests per second."""
    stock: float | None = None
    p50: float | None = None
    """Greatest multiple of libmodbus's round trip."""
    p99: float | None = None


def _values(registers: int, variety: int = VARIETY) -> list[bytes]:
    return [numbers(registers, number) for number in range(variety)]


def _coils() -> list[bytes]:
    return [struct.pack("<Q", 0x5555555555555555 << (number & 1)) for number in range(VARIETY)]


MANY = f"{WRITABLE}"
ROWS = {
    "FC3 10": Row(reading(DOUBLES_OUT, 10), libmodbus=0.85, stock=5.0, p50=1.1, p99=P99_AIM),
    "FC3 125": Row(reading(DOUBLES_OUT, 125), libmodbus=0.85, stock=10.0, p50=1.1, p99=P99_AIM),
    "FC16 10, same values": Row(writing(INTEGERS_IN, _values(10, 1)), libmodbus=0.5, p50=1.5),
    f"FC16 {MANY}, same values": Row(writing(INTEGERS_IN, _values(WRITABLE, 1)), libmodbus=0.3, p50=1.5),
    "FC16 10": Row(writing(INTEGERS_IN, _values(10)), libmodbus=0.5, p50=1.5),
    f"FC16 {MANY}": Row(writing(INTEGERS_IN, _values(WRITABLE)), libmodbus=0.3, p50=1.5),
    "FC23 10 in, 125 out": Row(writing_and_reading(INTEGERS_IN, _values(10), DOUBLES_OUT, 125)),
    "FC16 10, all on": Row(writing(INTEGERS_IN, _values(10)), whole=True, libmodbus=0.5, p50=1.5),
    f"FC16 {MANY}, all on": Row(writing(INTEGERS_IN, _values(WRITABLE)), whole=True, libmodbus=0.3, p50=1.5),
    "FC15 64 coils, all on": Row(writing_coils(0, _coils()), whole=True),
}

MANY_CONNECTIONS = f"""\
One request under way on each connection; client and server are two processes on one machine, libmodbus's server is its
own select() loop in C. gatewayd serves the full image from `gatewayd run` with a robot at {QUIET} Hz; its writes pass
ownership and limits and go to the robot. Each write has other values than the one before, unless the row says `same`.
All on: scale and limits, leases, one lock for 48 variables that two may own, the audit in a file, a robot at 500 Hz.
Median of {ROUNDS} rounds in which the servers take turns. us: server CPU time for each request.
{RULE}"""
ONE_CONNECTION = "As above, one connection: the time from the request's send() to its answer's recv(), in us."

Measured = dict[tuple[str, int, str], list[Load]]
"""By row, connections and server."""


def run(job: Job) -> list[Table]:
    """Two tables: many connections, one connection."""
    samples = Samples()
    measured: Measured = {}
    for whole in (False, True):
        with _servers(job, whole=whole) as servers:
            for name, connections, server in _turns(servers, whole=whole):
                served = servers[server]
                pid, request = served.process.pid, ROWS[name].request
                load = partial(measure, pid, served.port, connections, request, job.seconds / ROUNDS)
                found = samples.take(f"{name} {connections}", pid, load)
                measured.setdefault((name, connections, server), []).append(found)
    return [_many(job, measured, samples), _single(job, measured, samples)]


@contextmanager
def _servers(job: Job, *, whole: bool) -> Iterator[dict[str, Served]]:
    """The servers that take turns, by name; all of them run meanwhile."""
    with ExitStack() as stack:
        servers = {
            tree.name: stack.enter_context(whole_gateway(tree=tree) if whole else gateway(QUIET, tree=tree))
            for tree in job.trees
        }
        if libmodbus_is_there():
            servers["libmodbus"] = stack.enter_context(libmodbus())
        servers["stock"] = stack.enter_context(stock())
        yield servers


def _turns(servers: Iterable[str], *, whole: bool) -> Iterator[tuple[str, int, str]]:
    for _ in range(ROUNDS):
        for name, row in ROWS.items():
            if row.whole is whole:
                yield from ((name, count, server) for count in CONNECTIONS for server in servers)


def _middle(loads: list[Load] | None, figure: str) -> float | None:
    return median(getattr(load, figure) for load in loads) if loads else None


def _many(job: Job, measured: Measured, samples: Samples) -> Table:
    servers = (*job.names, *OTHERS)
    header = ["request"]
    for server in servers:
        header += [server, "us"]
    header += [f"/ {server}" for server in servers[1:]]
    table = Table("Modbus requests per second, 16 connections", MANY_CONNECTIONS, (*header, *NOISE))
    for name, row in ROWS.items():
        rates = {server: _middle(measured.get((name, 16, server)), "per_second") for server in servers}
        cells = [name]
        for server, rate in rates.items():
            cpu = _middle(measured.get((name, 16, server)), "cpu")
            cells += [f"{rate:,.0f}", f"{cpu * 1e6:.1f}"] if rate and cpu is not None else ["-", "-"]
        aims = {"libmodbus": row.libmodbus, "stock": row.stock}
        cells += [
            against(rates["gatewayd"], rates[server], at_least, aims.get(server)) for server in servers[1:]
        ]
        table.add(*cells, *samples.noise(f"{name} 16"))
    table.note = samples.note
    return table


def _single(job: Job, measured: Measured, samples: Samples) -> Table:
    servers = (*job.names, *OTHERS)
    header = ["request"]
    for server in servers:
        header += [f"{server} p50", "p99"]
    for server in servers[1:-1]:
        header += [f"p50 / {server}", "p99"]
    table = Table("Modbus round trip, 1 connection (us)", ONE_CONNECTION, (*header, *NOISE))
    for name, row in ROWS.items():
        times = {
            server: [_middle(measured.get((name, 1, server)), figure) for figure in ("p50", "p99")]
            for server in servers
        }
        cells = [name]
        for server in servers:
            cells += [f"{value * 1e6:.0f}" if value else "-" for value in times[server]]
        for server in servers[1:-1]:
            aims = (row.p50, row.p99) if server == "libmodbus" else (None, None)
            cells += [
                against(own, other, at_most, aim)
                for own, other, aim in zip(times["gatewayd"], times[server], aims, strict=True)
            ]
        table.add(*cells, *samples.noise(f"{name} 1"))
    return table
