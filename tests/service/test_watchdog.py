"""What a service manager hears of the running gateway, and when."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gatewayd.loop.progress import STEP
from gatewayd.mapping.loader import load_together
from gatewayd.report.verdict import ServedCell
from gatewayd.service.daemon import Daemon
from gatewayd.service.liveness import Progressed
from gatewayd.service.systemd import Notifier
from gatewayd.service.watchdog import STATUS_PERIOD, ManagerReporter
from gatewayd.simulator.server import SimulatedController

MAPPING = """\
gatewayd: 1
cell: press-3
robot: {{host: 127.0.0.1, port: {robot}, stale_after: 5s}}
modbus: {{listen: '127.0.0.1:{port}'}}
writers: {{plc: {{modbus: 127.0.0.1}}}}
variables:
  number: {{robot: input_int_register_0, modbus: 0}}
"""


class Manager:
    """Collects what comes."""

    def __init__(self, path: Path) -> None:
        self.address = str(path)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(path))
        self._socket.setblocking(False)
        self.heard: list[str] = []

    def read(self) -> list[str]:
        """What came since the last call."""
        found: list[str] = []
        while True:
            try:
                found.append(self._socket.recv(65536).decode())
            except BlockingIOError:
                self.heard += found
                return found

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    made = Manager(tmp_path / "notify")
    yield made
    made.close()


@pytest.fixture
def notifier(manager: Manager) -> Iterator[Notifier]:
    environment = {"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": "2000000"}
    made = Notifier(environment, os.getpid())
    yield made
    made.close()


class Gateway:
    """A daemon as a service sees it."""

    def __init__(self) -> None:
        self.runtimes: list[ServedCell] = []
        self.counts = {"core": 0, "robot": 1}
        self.wrong: list[str] = []

    def progress(self) -> dict[str, int]:
        return dict(self.counts)

    def troubles(self) -> list[str]:
        return self.wrong

    def turn(self) -> None:
        self.counts = {name: count + 1 for name, count in self.counts.items()}


def test_ready_is_said_once_all_parts_have_turned(manager: Manager, notifier: Notifier) -> None:
    gateway = Gateway()
    reporter = ManagerReporter(notifier, gateway)
    reporter.look(0.0)
    assert "READY=1" not in manager.read()
    gateway.turn()
    reporter.look(0.5)
    assert "READY=1" in manager.read()
    gateway.turn()
    reporter.look(1.0)
    assert manager.read() == ["WATCHDOG=1"]


def test_the_watchdog_is_fed_only_while_every_part_turns(
    manager: Manager, notifier: Notifier, caplog: pytest.LogCaptureFixture
) -> None:
    """From the first look at which one part has not turned since the last ping; its name comes before the end."""
    gateway = Gateway()
    reporter = ManagerReporter(notifier, gateway)
    fed, told = [], []
    for step in range(16):
        gateway.turn()
        if step >= 10:
            gateway.counts["robot"] = 99
        reporter.look(step / 2)
        heard = manager.read()
        if "WATCHDOG=1" in heard:
            fed.append(step / 2)
        if "STATUS=hangs: robot" in heard:
            told.append(step / 2)
    assert notifier.watchdog_after == 2.0
    assert fed == [step / 2 for step in range(11)]
    assert fed[-1] < told[0] < fed[-1] + notifier.watchdog_after
    assert [record.getMessage() for record in caplog.records] == ["a part of the gateway hangs"]


def test_a_changed_number_is_told_later_than_a_changed_word(manager: Manager, notifier: Notifier) -> None:
    gateway = Gateway()
    reporter = ManagerReporter(notifier, gateway)
    told = []
    for step, trouble in enumerate(["at 500 Hz", "at 499 Hz", "at 498 Hz", "lost", "lost"]):
        gateway.wrong = [trouble]
        gateway.turn()
        reporter.look(step / 2)
        told.append([one for one in manager.read() if one.startswith("STATUS=")])
    assert told == [["STATUS=at 500 Hz"], [], [], ["STATUS=lost"], []]
    gateway.wrong = ["at 1 Hz"]
    gateway.turn()
    reporter.look(3.0)
    gateway.wrong = ["at 2 Hz"]
    reporter.look(3.0 + STATUS_PERIOD)
    assert [one for one in manager.read() if "STATUS" in one] == ["STATUS=at 1 Hz", "STATUS=at 2 Hz"]


def test_the_status_has_what_is_wrong_with_audit_and_log(manager: Manager, notifier: Notifier) -> None:
    gateway = Gateway()
    gateway.wrong = ["no cell"]
    reporter = ManagerReporter(notifier, gateway)
    flooded = "press: more audit records of plc than are kept one by one"
    reporter.remarks = lambda: [flooded]
    reporter.look(0.0)
    assert f"STATUS=no cell; {flooded}" in manager.read()
    reporter.remarks = list
    reporter.look(STATUS_PERIOD)
    assert "STATUS=no cell" in manager.read()


def test_a_reload_ends_ready_whatever_came_of_it(manager: Manager, notifier: Notifier) -> None:
    reporter = ManagerReporter(notifier, Gateway())
    reporter.reload_begins()
    reporter.reload_ended(["reload refused: `part` is owned by plc"])
    begin, end = manager.read()
    assert begin.startswith("RELOADING=1\nMONOTONIC_USEC=")
    assert end == "READY=1\nSTATUS=reload refused: `part` is owned by plc"
    reporter.look(0.0)
    assert not any(one.startswith("STATUS") for one in manager.read())


async def test_a_defect_is_logged_once_and_feeds_nobody(
    manager: Manager, notifier: Notifier, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gatewayd.service.watchdog.PERIOD", 0.01)
    gateway = Gateway()

    def fail() -> dict[str, int]:
        raise RuntimeError("a defect")

    monkeypatch.setattr(gateway, "progress", fail)
    stop = asyncio.Event()
    task = asyncio.create_task(ManagerReporter(notifier, gateway).run(stop))
    await asyncio.sleep(0.1)
    stop.set()
    await task
    assert len(caplog.records) == 1
    assert [one.splitlines()[0] for one in manager.read()] == ["STOPPING=1"]


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(10):
        while not condition():  # noqa: ASYNC110  what is waited for is somebody else's state
            await asyncio.sleep(0.02)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def daemon(robot: int, port: int) -> Daemon:
    (loaded,) = load_together([("press-3.yaml", MAPPING.format(robot=robot, port=port).encode())])
    assert loaded.plan is not None
    return Daemon([loaded.plan], Path("/nonexistent"))


async def test_a_real_daemon_is_ready_without_its_robot_and_its_port(
    manager: Manager, notifier: Notifier
) -> None:
    """Robots and programs on the same port come and go; a service that waited for them would block the machine."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        gateway = daemon(free_port(), port)
        stop = asyncio.Event()
        tasks = [
            asyncio.create_task(run(stop)) for run in (gateway.run, ManagerReporter(notifier, gateway).run)
        ]
        try:
            await until(lambda: manager.read() and "READY=1" in manager.heard)
            assert any(f"not listening on 127.0.0.1:{port}" in one for one in manager.heard)
            assert any("press-3: robot not connected" in one for one in manager.heard)
        finally:
            stop.set()
            await asyncio.gather(*tasks)


@pytest.mark.slow
async def test_every_part_of_a_real_daemon_turns_whatever_its_peers_do() -> None:
    """A robot that is there, one whose host accepts and never says a word, one that refuses, a port that is taken."""
    with socket.socket() as dumb:
        dumb.bind(("127.0.0.1", 0))
        dumb.listen()
        async with SimulatedController() as robot:
            peers = [
                (robot.port, free_port()),
                (dumb.getsockname()[1], free_port()),
                (free_port(), robot.port),
            ]
            gateways = [daemon(*ports) for ports in peers]
            stop = asyncio.Event()
            tasks = [asyncio.create_task(gateway.run(stop)) for gateway in gateways]
            try:
                await until(lambda: all(all(gateway.progress().values()) for gateway in gateways))
                turned = [Progressed() for _ in gateways]
                for _ in range(6):
                    await asyncio.sleep(4 * STEP)
                    assert all(
                        one.all_of(gateway.progress()) for one, gateway in zip(turned, gateways, strict=True)
                    )
            finally:
                stop.set()
                await asyncio.gather(*tasks)
