"""A gateway with a device at work: the real control interface, link and line, and a Modbus server of the tests' own."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from gatewayd.audit.trail import Audit
from gatewayd.control import server as control_server
from gatewayd.control.api import Api
from gatewayd.control.endpoint import bind
from gatewayd.core.cell import Cell
from gatewayd.links.devices.modbus.lines import ModbusLines
from gatewayd.links.devices.modbus.link import ModbusDeviceLink
from gatewayd.modbus.client.unit import UnitState
from tests.control.served import FixedGateway, Served
from tests.links.devices.cells import HEAD, VARIABLES, device, planned
from tests.modbus.client.server import Server
from tests.modbus.client.world import Unit


@dataclass
class Plant:
    """A device, and the gateway that talks to it, if one does."""

    mapping: Path
    unit: Unit = field(default_factory=Unit)
    audit: Audit = field(default_factory=Audit)
    port: int = 0


class _Thread:
    """Runs a plant in a loop of its own, as commands have theirs."""

    def __init__(self, plant: Plant, socket: Path | None) -> None:
        self._plant, self._socket = plant, socket
        self._ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._stop = asyncio.Event()
        self._thread = threading.Thread(target=self._loop.run_until_complete, args=(self._run(),))
        self._thread.start()
        assert self._ready.wait(10)

    def end(self) -> None:
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(10)
        self._loop.close()

    async def _run(self) -> None:
        plant = self._plant
        served_unit = Server(plant.unit)
        await served_unit.start()
        plant.port = served_unit.port
        head = HEAD.replace("1503", str(plant.port))
        plant.mapping.write_text(head + VARIABLES)
        if self._socket is None:
            self._ready.set()
            await self._stop.wait()
        else:
            await self._serve(self._socket, head)
        await served_unit.stop()

    async def _serve(self, socket: Path, head: str) -> None:
        plan = planned(VARIABLES, head)
        served = Served(plan, Cell(plan.cell))
        links = {name: ModbusDeviceLink(device(plan, name), served.cell) for name in ("island", "gripper")}
        served.links |= links
        lines = ModbusLines()
        tasks = [
            asyncio.create_task(lines.run()),
            *(asyncio.create_task(link.run()) for link in links.values()),
        ]
        await asyncio.sleep(0)
        lines.serve(list(links.values()), {})
        while links["island"].station.state is not UnitState.ONLINE:  # noqa: ASYNC110 - the link has its own listener
            await asyncio.sleep(0.005)
        async with control_server.serving(bind(socket), Api(FixedGateway([served]), self._plant.audit), None):
            self._ready.set()
            await self._stop.wait()
        await lines.close()
        for task in tasks:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Plant]:
    """A gateway with the devices `island`, which answers, and `gripper`, whose serial port is not there."""
    made = Plant(tmp_path / "press.yaml")
    thread = _Thread(made, tmp_path / "control.sock")
    yield made
    thread.end()


@pytest.fixture
def lone_device(tmp_path: Path) -> Iterator[Plant]:
    """A device without a gateway."""
    made = Plant(tmp_path / "press.yaml")
    thread = _Thread(made, None)
    yield made
    thread.end()
