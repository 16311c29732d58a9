"""Each family makes its own links, and shares what they use among them."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Context
from gatewayd.links.devices.modbus.link import ModbusDeviceLink
from gatewayd.links.devices.runtime import RUNTIME
from tests.links.devices.cells import NOW, device, planned


def test_a_link_is_made_by_its_family(tmp_path: Path) -> None:
    plan = planned()
    parts = RUNTIME.share()
    link = RUNTIME.make(device(plan, "island"), Cell(plan.cell), Context(NOW, tmp_path, parts))
    assert isinstance(link, ModbusDeviceLink)
    assert parts.of("modbus") is parts.of("modbus")


def test_a_family_that_comes_later_is_run_as_well() -> None:
    async def scenario() -> None:
        parts = RUNTIME.share()
        running = asyncio.create_task(parts.run())
        await asyncio.sleep(0)
        await parts.prepare([planned()])
        names = {task.get_name() for task in asyncio.all_tasks()}
        assert "devices: modbus" in names
        running.cancel()
        with suppress(asyncio.CancelledError):
            await running

    asyncio.run(scenario())
