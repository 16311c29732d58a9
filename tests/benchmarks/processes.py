"""The programs under measurement: started, waited for, asked for their cost, stopped."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

__all__ = [
    "cpu_seconds",
    "free_port",
    "gatewayd",
    "listens",
    "python",
    "resident_megabytes",
    "running",
    "wait_until",
]

HOST = "127.0.0.1"
START_LIMIT = 15.0
"""Seconds in which a program has to listen."""
STOP_LIMIT = 5.0
TICKS = os.sysconf("SC_CLK_TCK")


def free_port() -> int:
    """A TCP port of the loopback interface that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        port: int = probe.getsockname()[1]
        return port


def python(*args: str | Path) -> list[str]:
    """Command line of this interpreter."""
    return [sys.executable, *map(str, args)]


def gatewayd(*args: str | Path) -> list[str]:
    """Command line of gatewayd."""
    return python("-m", "gatewayd", *args)


@contextmanager
def running(command: Sequence[str], port: int | None = None) -> Iterator[subprocess.Popen[bytes]]:
    """`command` as a process that listens on `port`; stopped at the end.

    RuntimeError with its last words if it dies.
    """
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL)
        try:
            if port is not None:
                wait_until(lambda: process.poll() is not None or listens(port), f"port {port}")
            if process.poll() is None:
                yield process
            if process.poll() is not None:
                log.seek(0)
                words = log.read()[-2000:].decode(errors="replace")
                raise RuntimeError(f"{' '.join(command)} ended with {process.returncode}:\n{words}")
        finally:
            process.terminate()
            try:
                process.wait(STOP_LIMIT)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def wait_until(
    condition: Callable[[], bool], what: str, limit: float = START_LIMIT, pause: float = 0.002
) -> None:
    """Return as soon as `condition` holds; TimeoutError names `what` was waited for."""
    end = time.monotonic() + limit
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"waited {limit:g} s in vain for {what}")
        time.sleep(pause)


def listens(port: int) -> bool:
    """Whether somebody accepts connections on the port."""
    try:
        socket.create_connection((HOST, port), 1).close()
    except OSError:
        return False
    return True


def cpu_seconds(pid: int) -> float:
    """User and system time that the process has used, all threads (proc(5), fields 14 and 15 of stat)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def resident_megabytes(pid: int) -> float:
    """Memory that the process occupies now (VmRSS)."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    raise RuntimeError(f"process {pid} has no VmRSS")
