"""The programs under measurement: started, waited for, stopped."""

from __future__ import annotations

import signal
import socket
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tests.e2e.processes import Process, wait_for

HOST = "127.0.0.1"
LAST_WORDS = 2000
"""Characters of a log that are worth showing."""


def free_port() -> int:
    """A TCP port of the loopback interface that nobody listens on now."""
    with socket.create_server((HOST, 0)) as probe:
        port: int = probe.getsockname()[1]
        return port


def listens(port: int) -> bool:
    """Whether somebody accepts connections on the port."""
    try:
        socket.create_connection((HOST, port), 1).close()
    except OSError:
        return False
    return True


def python(*args: str | Path) -> list[str]:
    """Command line of this interpreter."""
    return [sys.executable, *map(str, args)]


@contextmanager
def running(command: Sequence[str], port: int | None = None) -> Iterator[Process]:
    """`command` as a process that listens on `port`; stopped at the end.

    RuntimeError if it ends by itself. What goes wrong meanwhile has its last words as a note.
    """
    with tempfile.TemporaryDirectory() as folder:
        process = Process(command, Path(folder) / "log")
        try:
            if port is not None:
                wait_for(lambda: not process.running or listens(port), f"port {port}")
            if process.running:
                yield process
            _stop(process, command)
        except Exception as error:
            error.add_note(f"last words of {command[-1]}:\n{process.text()[-LAST_WORDS:]}")
            raise
        finally:
            process.kill()


def _stop(process: Process, command: Sequence[str]) -> None:
    if not process.running:
        raise RuntimeError(f"{' '.join(command)} ended by itself")
    process.signal(signal.SIGTERM)
    process.wait()
