"""Tests of this directory need a kernel with SocketCAN and the right to make interfaces in it.

Where the machine's own kernel offers that, they run on it. Elsewhere they run inside user-mode-linux, all in one boot
that starts when the tests are collected and goes on beside the others; here its reports are replayed one by one.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from tests.kernel.bench import SerialAdapter, ip, serial_adapters_work
from tests.kernel.uml import REPORTS, Boot

HERE = Path(__file__).parent
INSIDE = os.environ.get(REPORTS)
BOOT = pytest.StashKey[Boot]()


def own_kernel_serves() -> bool:
    """Whether this machine's kernel makes virtual and serial CAN interfaces for us."""
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError:
        return False
    name = f"vc{os.getpid()}"[:15]
    made = subprocess.run(["ip", "link", "add", name, "type", "vcan"], capture_output=True, check=False)
    if made.returncode:
        return False
    subprocess.run(["ip", "link", "delete", name], capture_output=True, check=False)
    return serial_adapters_work()


def directory_of_run(config: pytest.Config) -> Path:
    """A directory that all processes of this run share, and whose path has no space."""
    base: Path = getattr(config, "_tmp_path_factory").getbasetemp()  # noqa: B009 - fixtures do not exist yet
    shared = base.parent if os.environ.get("PYTEST_XDIST_WORKER") else base
    if any(character.isspace() for character in str(shared)):
        run = os.environ.get("PYTEST_XDIST_TESTRUNUID", str(os.getpid()))
        shared = Path("/tmp") / f"gatewayd-{os.getuid()}-{run}"  # noqa: S108 - made by us, named for this run
    return shared / "kernel"


def pytest_configure(config: pytest.Config) -> None:
    if INSIDE:
        config.pluginmanager.register(Outbox(config, INSIDE))


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put these tests last, so that what runs before them covers the boot, and start it."""
    ours = [item for item in items if HERE in item.path.parents]
    if not ours or INSIDE or config.option.collectonly:
        return
    items[:] = [item for item in items if HERE not in item.path.parents] + ours
    if own_kernel_serves():
        return
    missing = Boot.missing()
    if missing:
        for item in ours:
            item.add_marker(pytest.mark.skip(reason=f"this kernel has no vcan for us, and {missing}"))
        return
    boot = Boot(directory_of_run(config), config.rootpath)
    boot.start([item.nodeid for item in ours])
    config.stash[BOOT] = boot


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    boot = session.config.stash.get(BOOT, None)
    if boot is not None:
        boot.end(now=exitstatus == pytest.ExitCode.INTERRUPTED)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> bool | None:
    """Instead of running a test, report how it went inside."""
    boot = item.config.stash.get(BOOT, None)
    if boot is None or HERE not in item.path.parents:
        return None  # pytest asks for every test of the run
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    ended = False
    for data in boot.reports(item.nodeid):
        report = item.config.hook.pytest_report_from_serializable(config=item.config, data=data)
        item.ihook.pytest_runtest_logreport(report=report)
        ended = report.when == "teardown"
    if not ended:
        item.ihook.pytest_runtest_logreport(report=unfinished(item, boot))
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def unfinished(item: pytest.Item, boot: Boot) -> pytest.TestReport:
    """The report on a test that has none: the kernel came to an end before it did."""
    text = f"the kernel of user-mode-linux ended before this test did\n{boot.story()}"
    return pytest.TestReport(item.nodeid, item.location, {item.name: 1}, "failed", text, "call")


class Outbox:
    """Writes reports, one per line, as they come."""

    def __init__(self, config: pytest.Config, path: str) -> None:
        self._config = config
        self._path = path

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        data = self._config.hook.pytest_report_to_serializable(config=self._config, report=report)
        with Path(self._path).open("a") as file:
            file.write(json.dumps(data) + "\n")


@pytest.fixture
def vcan() -> Iterator[str]:
    """A virtual CAN interface that is up."""
    name = f"vcan{os.getpid() % 100000}"
    ip("link", "add", name, "type", "vcan")
    ip("link", "set", name, "up")
    yield name
    with contextlib.suppress(subprocess.CalledProcessError):  # the test may have deleted it
        ip("link", "delete", name)


@pytest.fixture
async def adapter() -> AsyncIterator[SerialAdapter]:
    """A serial adapter that is plugged in, configured for 500 kbit/s, and up."""
    made = SerialAdapter()
    made.plug_in()
    await made.configure(500_000)
    await made.up()
    yield made
    made.unplug()
