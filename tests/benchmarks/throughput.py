"""Modbus requests per second and round trips, beside libmodbus's C server and the stock pymodbus server."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from statistics import median

from tests.benchmarks.image import DOUBLES_OUT, INTEGERS_IN, WRITABLE
from tests.benchmarks.load import Load, Request, measure, reading, writing
from tests.benchmarks.report import Table, at_least, at_most
from tests.benchmarks.servers import Served, gateway, libmodbus, libmodbus_is_there, stock

Server = Callable[[], AbstractContextManager[Served]]

QUIET = 10
"""Packages per second of the robot meanwhile: this is about Modbus alone."""
ROUNDS = 3
"""Runs of each server in turn; the medians count."""
REQUESTS = {
    "read 10": reading(DOUBLES_OUT, 10),
    "read 125": reading(DOUBLES_OUT, 125),
    "write 10": writing(INTEGERS_IN, 10),
    f"write {WRITABLE}": writing(INTEGERS_IN, WRITABLE),
}
LIBMODBUS_AIM = 0.85
STOCK_AIMS = {"read 10": 5.0, "read 125": 10.0}
"""The aims are about reads. A write costs what its checks cost, which the other two servers do not make."""
P50_AIM = 1.10
P99_AIM = 1.5

DEFINITION = """\
One request under way on each connection; client and server are two processes on one machine, libmodbus's
server is its own select() loop in C. gatewayd serves the full image from `gatewayd run` with a robot at 10
Hz; its writes pass ownership and limits and go to the robot. Median of three interleaved runs. us: server
CPU time for each request."""


def run(seconds: float) -> list[Table]:
    """Two tables: many connections, one connection."""
    servers: dict[str, Server] = {"gatewayd": lambda: gateway(QUIET), "stock": stock}
    if libmodbus_is_there():
        servers["libmodbus"] = libmodbus
    measured = _measure(servers, seconds)
    return [_many(measured), _single(measured)]


Measured = dict[tuple[str, int, str], list[Load]]
"""By request, connections and server."""


def _measure(servers: dict[str, Server], seconds: float) -> Measured:
    measured: Measured = {}
    for _ in range(ROUNDS):
        for name, start in servers.items():
            with start() as served:
                for what, request in REQUESTS.items():
                    for connections in (1, 16):
                        load = _load(served, connections, request, seconds)
                        measured.setdefault((what, connections, name), []).append(load)
    return measured


def _load(served: Served, connections: int, request: Request, seconds: float) -> Load:
    return measure(served.process, served.port, connections, request, seconds / ROUNDS)


def _middle(loads: list[Load] | None, figure: str) -> float | None:
    return median(getattr(load, figure) for load in loads) if loads else None


def _many(measured: Measured) -> Table:
    table = Table(
        "Modbus requests per second, 16 connections",
        DEFINITION,
        (
            "registers",
            "gatewayd",
            "us",
            "libmodbus",
            "us",
            "stock",
            "us",
            "gatewayd / libmodbus",
            "gatewayd / stock",
        ),
    )
    for what in REQUESTS:
        rates = {
            name: _middle(measured.get((what, 16, name)), "per_second")
            for name in ("gatewayd", "libmodbus", "stock")
        }
        cells = [what]
        for name, rate in rates.items():
            cpu = _middle(measured.get((what, 16, name)), "cpu")
            cells += [f"{rate:,.0f}", f"{cpu * 1e6:.1f}"] if rate and cpu is not None else ["-", "-"]
        own, c_server, stock_server = rates["gatewayd"] or 0, rates["libmodbus"], rates["stock"] or 1
        if not c_server:
            cells.append("-")
        else:
            share = own / c_server
            cells.append(at_least(share, LIBMODBUS_AIM) if what in STOCK_AIMS else f"{share:.3g}")
        ratio = own / stock_server
        cells.append(at_least(ratio, STOCK_AIMS[what]) if what in STOCK_AIMS else f"{ratio:.3g}")
        table.add(*cells)
    return table


def _single(measured: Measured) -> Table:
    table = Table(
        "Modbus round trip, 1 connection (us)",
        "As above, one connection: the time from the request's send() to its answer's recv().",
        (
            "registers",
            "gatewayd p50",
            "p99",
            "libmodbus p50",
            "p99",
            "stock p50",
            "p99",
            "p50 / libmodbus",
            "p99 / libmodbus",
        ),
    )
    for what in REQUESTS:
        cells = [what]
        times: dict[str, list[float | None]] = {}
        for name in ("gatewayd", "libmodbus", "stock"):
            times[name] = [_middle(measured.get((what, 1, name)), figure) for figure in ("p50", "p99")]
            cells += [f"{value * 1e6:.0f}" if value else "-" for value in times[name]]
        for own, other, aim in zip(times["gatewayd"], times["libmodbus"], (P50_AIM, P99_AIM), strict=True):
            if not (own and other):
                cells.append("-")
            else:
                cells.append(at_most(own / other, aim) if what in STOCK_AIMS else f"{own / other:.3g}")
        table.add(*cells)
    return table
