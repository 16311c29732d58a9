"""A daemon that is not run, with one cell whose robot is up and whose PLC owns something; and a listener on it."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from gatewayd.audit.trail import Audit
from gatewayd.control.api import Api
from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.requester import Requester
from gatewayd.mapping.loader import load
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.service.daemon import Daemon
from gatewayd.web.access_control import AccessControl
from gatewayd.web.listener import StatusListener
from gatewayd.web.probes import Probes
from gatewayd.web.settings import settings
from tests.web.press import FORCE_LIMIT, HMI, MAPPING, PLC, SPARE, START, engineer


@pytest.fixture
def daemon() -> Daemon:
    loaded = load(MAPPING.encode(), "press.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return Daemon([loaded.plan], Path("/nonexistent"))


@pytest.fixture
def runtime(daemon: Daemon) -> CellRuntime:
    """The robot is fresh; `plc` owns start and force_limit, `hmi` was refused `start`, `spare` is unavailable."""
    found = daemon.runtimes[0]
    cell, now = found.cell, time.monotonic()
    cell.tick(now)
    cell.robot_connected(now, "controller 5.12")
    cell.set_availability([SPARE], False, "in use elsewhere", now)
    assert cell.package_arrived(1.0, now)
    cell.outputs_written(now)
    cell.adopt({}, now)
    cell.writer_connected(Requester(PLC), now, "127.0.0.2:1")
    cell.writer_connected(Requester(HMI), now, "127.0.0.3:1")
    assert cell.write(Requester(PLC), [Change(START, True), Change(FORCE_LIMIT, 12.5)], now) is None
    assert cell.write(Requester(HMI), [Change(START, False)], now) is not None
    return found


@pytest.fixture
def cell(runtime: CellRuntime) -> Cell:
    return runtime.cell


@pytest.fixture
def probes(runtime: CellRuntime, daemon: Daemon) -> Probes:
    assert runtime in daemon.runtimes
    found = Probes(daemon)
    found.look(time.monotonic())
    return found


@pytest.fixture
def access(daemon: Daemon, token_file: Path) -> AccessControl:
    found = AccessControl(settings("127.0.0.1:0", token_file), lambda: daemon.cells)
    found.refresh()
    return found


@pytest.fixture
async def listener(access: AccessControl, probes: Probes, daemon: Daemon) -> AsyncIterator[StatusListener]:
    found = StatusListener(access, probes, (Api(daemon, Audit()), None))
    await found.start()
    yield found
    await found.close()


@pytest.fixture
def token_file(tmp_path: Path) -> Path:
    return engineer(tmp_path / "tokens")
