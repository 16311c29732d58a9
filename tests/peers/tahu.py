"""A host application that others wrote: Eclipse Tahu's, the reference implementation of Sparkplug, as a process.

Needs Java 17 and Maven, which fetches it once in a machine's life; where they are missing, or it cannot be had, the
tests that ask for it are skipped.
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp

import pytest

from tests.e2e.processes import PATIENCE, Process, wait_for
from tests.peers.mosquitto import Mosquitto

_SOURCE = Path(__file__).parent / "tahu_host"
_LIBRARIES = Path.home() / ".m2" / "gatewayd-tests" / "tahu-host-1.0.14"
_FETCH_LIMIT = 110
_START_LIMIT = 60.0
"""Seconds to compile one file and start: long where a dozen others do the like."""


def _libraries() -> Path:
    """The folder with the archives that Maven fetched."""
    maven = shutil.which("mvn")
    if maven is None or shutil.which("java") is None:
        pytest.skip("no Java with Maven")
    if not _LIBRARIES.exists():
        _LIBRARIES.parent.mkdir(parents=True, exist_ok=True)
        fetched = Path(mkdtemp(dir=_LIBRARIES.parent))
        command = [maven, "-q", "-B", "dependency:copy-dependencies", f"-DoutputDirectory={fetched}"]
        try:
            subprocess.run(command, cwd=_SOURCE, check=True, capture_output=True, timeout=_FETCH_LIMIT)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
            shutil.rmtree(fetched)
            pytest.skip(f"Maven cannot fetch the host application: {str(error.stdout or error)[:200]}")
        with contextlib.suppress(OSError):
            # Another process may have been quicker.
            fetched.rename(_LIBRARIES)
    return _LIBRARIES


class TahuHost:
    """What the host application reports, and what it is told to do. An event: its name, the descriptor, and words."""

    def __init__(self, broker: Mosquitto, log: Path, name: str, group: str, *credentials: str) -> None:
        classes = f"{_libraries()}/*:{_SOURCE}"
        where = [broker.host, str(broker.port), name, group, *credentials]
        # Little memory and no optimising compiler: it starts sooner, and has not much to do.
        options = ["-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC", "-Xmx128m"]
        self._process = Process(["java", *options, "-cp", classes, str(_SOURCE / "Host.java"), *where], log)
        self.events: list[list[str]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.wait_for(lambda: bool(self.of("onConnect")), "the host application", _START_LIMIT)

    def _read(self) -> None:
        assert self._process.popen.stdout is not None
        for line in self._process.popen.stdout:
            self.events.append(line.rstrip("\n").split("\t"))

    def wait_for(self, condition: Callable[[], bool], what: str, limit: float = PATIENCE) -> None:
        """As `wait_for`, and tell what it logged if it is in vain."""

        def holds() -> bool:
            assert self._process.running, self.log()
            return condition()

        try:
            wait_for(holds, what, limit)
        except AssertionError as error:
            raise AssertionError(
                f"{error}; it has reported {self.events[-20:]} and logged {self.log()}"
            ) from None

    def log(self) -> str:
        """What it has logged."""
        return self._process.text()

    def of(self, event: str, descriptor: str = "") -> list[list[str]]:
        """The words of the events of this name, of this edge node or device if one is named."""
        return [
            one[1:]
            for one in list(self.events)
            if one[0] == event and (not descriptor or one[1] == descriptor)
        ]

    def metrics(self, event: str, descriptor: str) -> dict[str, list[str]]:
        """Metric -> type, value, historical or live, timestamp, properties, as the latest of these events had it."""
        return {one[1]: one[2:] for one in self.of(event, descriptor)}

    def rebirth(self, node: str) -> None:
        """Ask for a rebirth."""
        self._tell("rebirth", node)

    def command(self, node: str, device: str, metric: str, kind: str, value: str) -> None:
        """Write a metric of a device, or of an edge node where the device is empty."""
        self._tell("command", node, device, metric, kind, value)

    def quit(self) -> None:
        """Say that it goes, and end."""
        self._tell("quit")
        self._process.wait()

    def kill(self) -> None:
        """End it without giving it a chance."""
        self._process.kill()
        self._reader.join()

    def _tell(self, *words: str) -> None:
        assert self._process.popen.stdin is not None
        self._process.popen.stdin.write("\t".join(words) + "\n")


@contextmanager
def tahu_host(broker: Mosquitto, log: Path, name: str, group: str, *credentials: str) -> Iterator[TahuHost]:
    """A connected host application for as long as the block lasts."""
    host = TahuHost(broker, log, name, group, *credentials)
    try:
        yield host
    finally:
        host.kill()
