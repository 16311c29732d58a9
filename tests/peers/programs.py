"""Modbus servers that others wrote, as processes: libmodbus in C, simonvetter/modbus in Go. And what stands between.

The sources beside this module only start them. Where a compiler is missing, or the Go module cannot be had, the tests
that ask for them are skipped.
"""

from __future__ import annotations

import contextlib
import os
import pty
import selectors
import shutil
import subprocess
import sys
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.benchmarks.compiled import HEADERS, libmodbus_is_there
from tests.e2e.processes import HOST, Process, free_port

_HERE = Path(__file__).parent
_BUILD_LIMIT = 110
"""Seconds for Go to compile its standard library, once in a machine's life."""


def libmodbus_server(folder: Path) -> str:
    """The program, compiled into the folder."""
    if not libmodbus_is_there():
        pytest.skip("no C compiler with libmodbus's headers")
    return compile_libmodbus_server(folder)


def compile_libmodbus_server(folder: Path) -> str:
    """As above, where the compiler is known to be there."""
    program = folder / "libmodbus_server"
    source = _HERE / "libmodbus_server.c"
    subprocess.run(["cc", "-O2", HEADERS, "-o", program, source, "-lmodbus"], check=True)
    return str(program)


def go_server(folder: Path) -> str:
    """The program, compiled into the folder."""
    return _go_program("go_server", folder)


def go_client(folder: Path) -> str:
    """The client with TLS, compiled into the folder."""
    return _go_program("go_client", folder)


def _go_program(name: str, folder: Path) -> str:
    go = shutil.which("go")
    if go is None:
        pytest.skip("no Go compiler")
    program = folder / name
    built = subprocess.run(
        [go, "build", "-o", program, "."],
        cwd=_HERE / name,
        env={**os.environ, "GOTOOLCHAIN": "local"},
        capture_output=True,
        text=True,
        check=False,
        timeout=_BUILD_LIMIT,
    )
    if built.returncode:
        pytest.skip(f"not to be had: {built.stderr.strip()[:200]}")
    return str(program)


PROGRAMS: dict[str, Callable[[Path], str]] = {"libmodbus": libmodbus_server, "go": go_server}
"""TCP servers with units 1 to 3, whose holding registers hold their own addresses at first."""


@contextmanager
def started(command: list[str], log: Path) -> Iterator[tuple[Process, str]]:
    """The process, once it has said that it listens, and what else it has said then."""
    process = Process(command, log)
    try:
        answer = process.answer()
        assert answer.startswith("listening"), process.text()
        yield process, answer.removeprefix("listening").strip()
    finally:
        process.kill()


@contextmanager
def tcp_server(name: str, program: str, folder: Path) -> Iterator[int]:
    """The server of PROGRAMS at work; its port."""
    port = free_port()
    own = [program, "tcp", HOST, str(port)] if name == "libmodbus" else [program, f"{HOST}:{port}"]
    with started(own, folder / f"{name}.log"):
        yield port


class Proxy:
    """The fault proxy at work."""

    def __init__(self, process: Process, port: int) -> None:
        self._process = process
        self.port = port

    def order(self, line: str) -> None:
        """Treat the unit's answers like this from now on (`fault_proxy`)."""
        assert self._process.popen.stdin is not None
        self._process.popen.stdin.write(line + "\n")
        assert self._process.answer() == "done"


@contextmanager
def fault_proxy(port: int, unit: int, folder: Path) -> Iterator[Proxy]:
    """A proxy before the server at `port` that spoils the answers of one unit."""
    program = str(_HERE / "fault_proxy.py")
    command = [sys.executable, program, HOST, str(port), str(unit)]
    with started(command, folder / "proxy.log") as (process, answer):
        yield Proxy(process, int(answer))


class Bus:
    """A serial line in two wires, made of pseudo terminals: everybody hears everybody else.

    libmodbus's servers depend on it: after a request to another unit they take what comes next for its answer.
    """

    def __init__(self, servers: int) -> None:
        self._far: list[int] = []
        self.names = [self._terminal() for _ in range(servers + 1)]
        """Device names: the client's, then those of the servers."""
        self.is_cut = False
        """Whether nothing gets through."""
        self._selector = selectors.DefaultSelector()
        for far in self._far:
            self._selector.register(far, selectors.EVENT_READ)
        self._ends, self._end = os.pipe()
        self._selector.register(self._ends, selectors.EVENT_READ)
        self._thread = threading.Thread(target=self._copy, name="bus", daemon=True)
        self._thread.start()

    def _terminal(self) -> str:
        far, near = pty.openpty()
        tty.setraw(near)
        self._far.append(far)
        self._near = [*getattr(self, "_near", []), near]
        return os.ttyname(near)

    def _copy(self) -> None:
        while True:
            for key, _ in self._selector.select():
                if key.fd == self._ends:
                    return
                data = os.read(key.fd, 4096)
                if self.is_cut:
                    continue
                for other in self._far:
                    if other != key.fd:
                        os.write(other, data)

    def close(self) -> None:
        """Unplug everybody."""
        os.write(self._end, b"x")
        self._thread.join()
        self._selector.close()
        for file in (*self._far, *self._near, self._ends, self._end):
            with contextlib.suppress(OSError):
                os.close(file)


@contextmanager
def serial_bus(program: str, units: tuple[int, ...], baudrate: int, folder: Path) -> Iterator[Bus]:
    """A serial line with one libmodbus server for each unit."""
    bus = Bus(len(units))
    with contextlib.ExitStack() as stack:
        stack.callback(bus.close)
        for name, unit in zip(bus.names[1:], units, strict=True):
            command = [program, "rtu", name, str(baudrate), str(unit)]
            stack.enter_context(started(command, folder / f"unit{unit}.log"))
        yield bus
