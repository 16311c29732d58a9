"""One listener for each address: opened, shared, tried again, given another cell and closed. Rest: test_listener.py."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import replace

import pytest

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Level, PrepareError
from gatewayd.links.modbus_server import listeners as listeners_module
from gatewayd.links.modbus_server.link import ModbusUnit
from gatewayd.links.modbus_server.listeners import Listeners
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.loader import load_together
from gatewayd.mapping.plan import Plan

CELL = """\
gatewayd: 1
cell: cell-{unit}
robot: {{host: 127.0.0.1}}
modbus: {{listen: '127.0.0.1:{port}', unit: {unit}}}
variables: {{number: {{robot: output_int_register_0, modbus: 0}}}}
"""


def plan_of(unit: int, port: int) -> Plan:
    (loaded,) = load_together([(f"{unit}.yaml", CELL.format(unit=unit, port=port).encode())])
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def unit_of(unit: int, port: int) -> ModbusUnit:
    plan = plan_of(unit, port)
    return ModbusUnit(plan.the(ModbusPlan), Cell(plan.cell))


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(10):
        while not condition():  # noqa: ASYNC110  what is waited for is somebody else's state
            await asyncio.sleep(0.005)


@asynccontextmanager
async def running(shared: Listeners) -> AsyncIterator[None]:
    task = asyncio.create_task(shared.run())
    try:
        yield
    finally:
        await shared.close()
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


async def accepts(port: int) -> bool:
    try:
        _reader, writer = await asyncio.open_connection("127.0.0.1", port)
    except ConnectionError:
        return False
    writer.close()
    return True


async def test_units_of_one_address_share_a_listener() -> None:
    shared, port = Listeners(), free_port()
    first, second, other = unit_of(1, port), unit_of(2, port), unit_of(1, free_port())
    shared.serve([first, second, other], {})
    assert first.listeners == second.listeners != other.listeners
    assert shared.progress() == {f"listener {one.name}": 0 for one in shared.listeners}
    assert len(shared.troubles()) == 2
    async with running(shared):
        await until(lambda: first.reachable and other.reachable)
        assert all(shared.progress().values())
        assert shared.troubles() == []
        assert (first.health().level, first.health().words) == (Level.GOOD, "listening, no connections")


async def test_an_address_that_is_taken_is_reported_once_and_had_when_it_is_free(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(listeners_module, "RETRY_PERIOD", 0.02)
    caplog.set_level("INFO")
    shared = Listeners()
    with socket.create_server(("127.0.0.1", 0)) as other:
        unit = unit_of(1, other.getsockname()[1])
        shared.serve([unit], {})
        async with running(shared):
            await until(lambda: next(iter(shared.progress().values())) > 3)
            assert unit.health().level is Level.BAD
            other.close()
            await until(lambda: unit.reachable)
    assert caplog.text.count("another program listens there") == 1
    assert caplog.text.count("listening for Modbus") == 1


async def test_what_was_prepared_is_used_or_given_back() -> None:
    shared, port, port_now = Listeners(), free_port(), free_port()
    unit = unit_of(1, port_now)
    shared.serve([unit], {})
    async with running(shared):
        await until(lambda: unit.reachable)
        prepared = await shared.prepare([plan_of(1, port)])
        await prepared.abort()
        assert not await accepts(port)
        assert unit.listeners == shared.listeners
        prepared = await shared.prepare([plan_of(1, port)])
        prepared.commit()
        (former,) = unit.listeners
        plan = plan_of(1, port)
        unit.rebind(plan.the(ModbusPlan), Cell(plan.cell), 1.0)
        shared.serve([unit], {})
        assert unit.reachable
        assert unit.listeners != [former]
        await until(lambda: not former.listening)
        assert not await accepts(port_now)


async def test_one_address_that_cannot_be_had_costs_the_others_that_were_new_too() -> None:
    shared = Listeners()
    with socket.create_server(("127.0.0.1", 0)) as other:
        taken, free = other.getsockname()[1], free_port()
        with pytest.raises(PrepareError, match="another program listens there"):
            await shared.prepare([plan_of(1, free), plan_of(2, taken)])
        assert not await accepts(free)
    assert shared.listeners == []


async def test_another_address_of_a_present_port_is_left_to_the_swap() -> None:
    shared, port = Listeners(), free_port()
    unit = unit_of(1, port)
    shared.serve([unit], {})
    async with running(shared):
        await until(lambda: unit.reachable)
        plan = plan_of(1, port)
        moved = plan.with_links(modbus=replace(plan.the(ModbusPlan), host="127.0.0.2"))
        prepared = await shared.prepare([moved])
        prepared.commit()
        assert len(shared.listeners) == 1
