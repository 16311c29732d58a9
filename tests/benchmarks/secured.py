"""Modbus with TLS beside Modbus without, on one listener each of one process: `python -m tests.benchmarks.secured`.

Prints requests per second and CPU per request, handshakes per second, and what plain clients notice of a flood of half
handshakes. By hand; no figure of it is a test.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import socket
import ssl
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import quantiles

from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.plan import RoleRights, SecuredPlan
from gatewayd.links.modbus_server.renewal import make_ready
from tests.links.modbus_server.conftest import bring_up, draw, make_cell, make_plan
from tests.links.modbus_server.secured import (
    Certificates,
    client_context,
    frame,
    make_certificates,
)

_SECONDS = 3.0
_READS = {10: frame(bytes.fromhex("03 00c8 000a")), 96: frame(bytes.fromhex("03 00c8 0060"))}
_LIMITED = "viewer"
"""A role that may read everything is as quick as that of the operator."""


def _serve(certificates: Certificates, ports: multiprocessing.Queue[tuple[int, int]]) -> None:
    asyncio.run(_serving(certificates, ports))


async def _serving(certificates: Certificates, ports: multiprocessing.Queue[tuple[int, int]]) -> None:
    sketch = draw()
    cell = make_cell(sketch)
    bring_up(cell, time.monotonic())
    cell.freshness.stale_after = 3600.0
    roles = (RoleRights("operator", None, None), RoleRights(_LIMITED, None))
    tls = SecuredPlan("127.0.0.1", 0, certificates.files(), roles)
    plan = replace(make_plan(sketch, connections=512), tls=tls, connections_per_peer=512)
    plain = ModbusListener("127.0.0.1", 0)
    secured = ModbusListener("127.0.0.1", 0, files=tls.files)
    for listener in (plain, secured):
        listener.serve([(plan, cell)])
        await make_ready(listener)
        await listener.start()
    ports.put((plain.port, secured.port))
    await asyncio.get_running_loop().create_future()


def _cpu(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _round_trips(connection: socket.socket, request: bytes, size: int, end: float) -> list[float]:
    took: list[float] = []
    while (begun := time.perf_counter()) < end:
        connection.sendall(request)
        missing = size
        while missing:
            missing -= len(connection.recv(missing))
        took.append(time.perf_counter() - begun)
    return took


def _rate(
    process: int, connect: Callable[[], socket.socket], registers: int
) -> tuple[float, float, float, float]:
    """Requests per second, CPU of the server per request, and p50 and p99 of a round trip, with one connection."""
    with connect() as connection:
        before = _cpu(process)
        took = _round_trips(connection, _READS[registers], 9 + 2 * registers, time.perf_counter() + _SECONDS)
        cpu = (_cpu(process) - before) / len(took)
    cuts = quantiles(took, n=100)
    return len(took) / _SECONDS, cpu * 1e6, cuts[49] * 1e6, cuts[98] * 1e6


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as folder:
        certificates = make_certificates(Path(folder) / "made")
        ports: multiprocessing.Queue[tuple[int, int]] = multiprocessing.Queue()
        server = multiprocessing.Process(target=_serve, args=(certificates, ports), daemon=True)
        server.start()
        assert server.pid is not None
        plain, secured = ports.get(timeout=30)
        context = client_context(certificates, certificates.operator)

        def dial() -> socket.socket:
            return socket.create_connection(("127.0.0.1", plain))

        def dial_secured() -> socket.socket:
            return context.wrap_socket(socket.create_connection(("127.0.0.1", secured)))

        for registers in _READS:
            for name, connect in (("plain", dial), ("TLS", dial_secured)):
                rate, cpu, half, most = _rate(server.pid, connect, registers)
                print(
                    f"{registers:3} registers, {name:5}: {rate:7.0f} requests/s, {cpu:5.1f} us CPU each, "
                    f"round trip p50 {half:.0f} us, p99 {most:.0f} us"
                )
        for version in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
            context.maximum_version = version
            before, begun, count = _cpu(server.pid), time.perf_counter(), 0
            while time.perf_counter() - begun < _SECONDS:
                dial_secured().close()
                count += 1
            cpu = (_cpu(server.pid) - before) / count
            print(
                f"{version.name}: {count / _SECONDS:.0f} handshakes/s one after the other, {cpu * 1e3:.2f} ms CPU each"
            )
        _flooded(server.pid, dial, secured)
        server.terminate()


def _flooded(process: int, dial: Callable[[], socket.socket], secured: int) -> None:
    """What a plain client notices while another process begins handshakes and finishes none."""
    flood = multiprocessing.Process(target=_flood, args=(secured,), daemon=True)
    for name in ("without a flood", "with a flood of half handshakes"):
        before, begun = _cpu(process), time.perf_counter()
        with dial() as connection:
            took = []
            while time.perf_counter() - begun < _SECONDS:
                took += _round_trips(connection, _READS[10], 29, time.perf_counter() + 1e-6)
                time.sleep(0.002)
        cuts = quantiles(took, n=100)
        cpu = (_cpu(process) - before) / (time.perf_counter() - begun)
        print(
            f"plain client each 2 ms {name}: p50 {cuts[49] * 1e6:.0f} us, p99 {cuts[98] * 1e6:.0f} us, "
            f"max {max(took) * 1e6:.0f} us, server {cpu:.0%} of a core"
        )
        if not flood.is_alive():
            flood.start()
            time.sleep(0.5)
    flood.terminate()


def _flood(port: int) -> None:
    """Client hellos, as many as can be sent, each on a connection of its own."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    outgoing = ssl.MemoryBIO()
    engine = context.wrap_bio(ssl.MemoryBIO(), outgoing)
    try:
        engine.do_handshake()
    except ssl.SSLWantReadError:
        hello = outgoing.read()
    kept: list[socket.socket] = []
    while True:
        connection = socket.create_connection(("127.0.0.1", port))
        connection.sendall(hello)
        kept.append(connection)
        if len(kept) > 200:
            kept.pop(0).close()


if __name__ == "__main__":
    main()
