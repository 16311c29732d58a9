"""A gateway for commands to talk to: the real control interface on a real socket, in a thread, without a robot."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from gatewayd.core.cell import Cell
from tests.control.served import FixedGateway, Served, bring_up, plan


@dataclass
class Running:
    """A served gateway. The cell belongs to the server's thread: change it by `do`."""

    path: Path
    cell: Cell
    loop: asyncio.AbstractEventLoop
    served: Served
    fixed: FixedGateway

    def do(self, act: Callable[[Cell], object]) -> None:
        """Do something to the cell, in its own thread."""

        async def inside() -> None:
            act(self.cell)

        asyncio.run_coroutine_threadsafe(inside(), self.loop).result(10)


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Running]:
    """One cell, `press`, as in tests/control/served.py; its robot up at time 0 of the monotonic clock."""
    from gatewayd.audit.trail import Audit
    from gatewayd.control import server
    from gatewayd.control.api import Api
    from gatewayd.control.endpoint import bind

    served = Served(plan(), Cell(plan().cell))
    bring_up(served.cell, 0.0)
    audit = Audit()
    audit.watch(served.cell)
    path = tmp_path / "control.sock"
    loop = asyncio.new_event_loop()
    stop = asyncio.Event()
    ready = threading.Event()
    fixed = FixedGateway([served])

    async def serve() -> None:
        async with server.serving(bind(path), Api(fixed, audit, traced=fixed), None):
            ready.set()
            await stop.wait()

    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    assert ready.wait(10)
    yield Running(path, served.cell, loop, served, fixed)
    loop.call_soon_threadsafe(stop.set)
    thread.join(10)
    loop.close()


Invoke = Callable[..., Result]


@pytest.fixture
def invoke(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Invoke:
    """`gatewayd ARGS` in this process, talking to the socket in `tmp_path`."""
    monkeypatch.setenv("GATEWAYD_CONTROL", str(tmp_path / "control.sock"))

    def run(*args: str) -> Result:
        return CliRunner().invoke(command, args, prog_name="gatewayd")

    return run
