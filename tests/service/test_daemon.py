"""The daemon's parts that need no other process: one listener per address, and what a defect costs. Rest: tests/e2e."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path

import pytest

from gatewayd.core.freshness import Source
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.listeners import Listeners
from gatewayd.loop.progress import STEP
from gatewayd.mapping.loader import load_together
from gatewayd.mapping.plan import Plan
from gatewayd.service import daemon as daemon_module
from gatewayd.service.daemon import Daemon
from gatewayd.service.liveness import Progressed
from gatewayd.simulator.server import SimulatedController

STATE = Path("/nonexistent/gatewayd")  # nothing here keeps anything

CELL = """\
gatewayd: 1
cell: cell-{unit}
robot: {{host: 127.0.0.1, port: {robot}, stale_after: 5s}}
modbus: {{listen: '127.0.0.1:{port}', unit: {unit}}}
writers: {{plc: {{modbus: 127.0.0.1}}}}
variables:
  number: {{robot: input_int_register_0, modbus: 0}}
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def plans(*cells: tuple[int, int, int]) -> list[Plan]:
    """Of (unit, robot's port, listener's port)."""
    files = [
        (f"{unit}.yaml", CELL.format(unit=unit, robot=robot, port=port).encode())
        for unit, robot, port in cells
    ]
    return [one.plan for one in load_together(files) if one.plan is not None]


def listeners(daemon: Daemon) -> list[ModbusListener]:
    shared = daemon.shared.of("modbus")
    assert isinstance(shared, Listeners)
    return shared.listeners


Running = Callable[[Daemon], AbstractAsyncContextManager[asyncio.Task[None]]]


@pytest.fixture
def running() -> Running:
    """The daemon, running; stopped at the end."""

    @asynccontextmanager
    async def run(daemon: Daemon) -> AsyncIterator[asyncio.Task[None]]:
        stop = asyncio.Event()
        task = asyncio.create_task(daemon.run(stop))
        try:
            yield task
        finally:
            stop.set()
            async with asyncio.timeout(5):
                await task

    return run


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(10):
        while not condition():  # noqa: ASYNC110  what is waited for is somebody else's state
            await asyncio.sleep(0.005)


def test_cells_share_a_listener_by_address() -> None:
    daemon = Daemon(plans((1, 31001, 1502), (2, 31002, 1502), (3, 31003, 1503)), STATE)
    assert len(daemon.runtimes) == 3
    assert [listener.name for listener in listeners(daemon)] == ["127.0.0.1:1502", "127.0.0.1:1503"]


def test_a_cell_without_modbus_has_no_listener() -> None:
    text = "gatewayd: 1\ncell: a\nrobot: {host: 127.0.0.1}\nvariables: {x: {robot: output_int_register_0}}\n"
    (loaded,) = load_together([("a.yaml", text.encode())])
    assert loaded.plan is not None, loaded.diagnostics
    assert list(Daemon([loaded.plan], STATE).shared) == []


async def test_a_defect_in_one_cell_costs_neither_the_others_nor_the_process(
    running: Running, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Whatever raises in the clock tick of a cell is logged; the next tick comes."""
    async with SimulatedController() as robot:
        daemon = Daemon(plans((1, robot.port, free_port()), (2, free_port(), free_port())), STATE)
        good, bad = daemon.runtimes

        def fail(_now: float) -> None:
            raise RuntimeError("a defect")

        monkeypatch.setattr(bad.cell, "tick", fail)
        async with running(daemon) as task:
            await until(lambda: good.cell.accepts_writes)
            heartbeat = good.cell.health.heartbeat
            await until(lambda: good.cell.health.heartbeat > heartbeat + 3)
            assert not task.done()
    assert len([record for record in caplog.records if "internal error" in record.getMessage()]) == 1


async def test_a_cell_is_reachable_once_its_listener_listens(running: Running) -> None:
    """Adopted values wait for an owner from then on, not while nobody could come."""
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = int(other.getsockname()[1])
        async with SimulatedController() as robot, SimulatedController() as another:
            daemon = Daemon(plans((1, robot.port, port), (2, another.port, free_port())), STATE)
            waiting, served = (runtime.cell for runtime in daemon.runtimes)
            async with running(daemon):
                await until(lambda: waiting.accepts_writes and served.adoption.reachable)
                assert not waiting.adoption.reachable


async def test_a_cell_without_a_fieldbus_waits_for_none(running: Running) -> None:
    text = "gatewayd: 1\ncell: a\nrobot: {host: 127.0.0.1, port: 9}\nvariables: {x: {robot: output_int_register_0}}\n"
    (loaded,) = load_together([("a.yaml", text.encode())])
    assert loaded.plan is not None, loaded.diagnostics
    daemon = Daemon([loaded.plan], STATE)
    async with running(daemon):
        await until(lambda: daemon.cells[0].adoption.reachable)


async def test_a_link_that_ends_by_a_defect_is_started_again(
    running: Running, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(daemon_module, "RETRY_PERIOD", 0.1)
    async with SimulatedController() as robot:
        daemon = Daemon(plans((1, robot.port, free_port())), STATE)
        (runtime,) = daemon.runtimes
        original = runtime.cell.package_arrived
        failures = 2

        def fail(timestamp: float | None, now: float, raw: float | None = None) -> bool:
            nonlocal failures
            if failures:
                failures -= 1
                raise RuntimeError("a defect")
            return original(timestamp, now, raw)

        monkeypatch.setattr(runtime.cell, "package_arrived", fail)
        async with running(daemon):
            await until(lambda: runtime.cell.freshness.state is Source.FRESH)
            assert runtime.cell.accepts_writes
    assert len([record for record in caplog.records if "internal error" in record.getMessage()]) == 2


@pytest.mark.slow
async def test_a_link_that_rests_after_a_defect_turns_and_a_core_that_fails_does_not(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The watchdog ends a process in which nobody would notice that values have become stale, and no other."""

    def fail(*_arguments: object) -> bool:
        raise RuntimeError("a defect")

    async with SimulatedController() as robot:
        daemon = Daemon(plans((1, robot.port, free_port())), STATE)
        (runtime,) = daemon.runtimes
        turned = Progressed()
        async with running(daemon):
            await until(lambda: turned.all_of(daemon.progress()))
            monkeypatch.setattr(runtime.cell, "package_arrived", fail)
            for _ in range(4):
                await asyncio.sleep(4 * STEP)
                assert turned.all_of(daemon.progress())
            monkeypatch.setattr(runtime.cell, "tick", fail)
            await asyncio.sleep(2 * STEP)
            turned.all_of(daemon.progress())
            await asyncio.sleep(4 * STEP)
            assert not turned.all_of(daemon.progress())


def test_an_observer_sees_every_cell_that_a_reload_brings_before_it_is_served() -> None:
    first, second = plans((1, 8, 9), (2, 9, 9))
    daemon = Daemon([first], STATE)
    seen: list[str] = []
    daemon.observe(lambda cell: seen.append(cell.definition.name))
    daemon.swap([first, second], 1.0)
    assert seen == ["cell-1", "cell-2"]
