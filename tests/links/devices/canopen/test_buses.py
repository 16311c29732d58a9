"""Managers of buses: one for each, devices that come and go, what cannot be managed."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from dataclasses import replace
from uuid import uuid4

import pytest

from gatewayd.canopen.frame import Frame
from gatewayd.core.cell import Cell
from gatewayd.links.contract import Passage
from gatewayd.links.devices.canopen.buses import CanopenBuses
from gatewayd.links.devices.canopen.link import CanopenDeviceLink
from tests.links.canopen_node.recorder import until
from tests.links.devices.canopen.cells import an_encoder, link_of, managed, planned, the_device


async def test_devices_of_two_cells_have_one_manager_and_the_second_of_a_node_none() -> None:
    channel = str(uuid4())
    plan = planned(channel=channel)
    one, other = link_of(plan, Cell(plan.cell)), link_of(plan, Cell(plan.cell))
    six = replace(the_device(plan), node=replace(the_device(plan).node, node=6, pdos=()), places=())
    third = CanopenDeviceLink(six, Cell(plan.cell))
    async with an_encoder(channel), managed([one, third]) as buses:
        buses.serve([one, other, third], {})
        assert len(buses.buses) == 1
        assert one.manager is third.manager is not None
        await until(lambda: one.health().figures["state"] == "good")
        assert other.health().figures["reason"] == "node 5 is managed already"
        # A device goes, and the others on its bus do not notice.
        buses.serve([one], {})
        assert third.node is None
        assert one.health().figures["boots"] == 1
        # The bus goes with its last device.
        buses.serve([], {})
        assert buses.buses == {}
        assert one.manager is None


async def test_the_end_of_the_gateway_is_no_loss_of_a_device(caplog: pytest.LogCaptureFixture) -> None:
    channel = str(uuid4())
    plan = planned(channel=channel)
    link = link_of(plan, Cell(plan.cell))
    async with an_encoder(channel), managed([link]) as buses:
        await until(lambda: link.health().figures["state"] == "good")
        await buses.close()
        assert link.node is None
    assert "device lost" not in caplog.text


async def test_bus_that_changes_begins_anew() -> None:
    channel = str(uuid4())
    plan, changed = (
        planned(channel=channel),
        planned(channel=channel, more=", manager: 127, manager_heartbeat: 50ms"),
    )
    link = link_of(plan, Cell(plan.cell))
    async with an_encoder(channel), managed([link]) as buses:
        await until(lambda: link.health().figures["state"] == "good")
        successor = link_of(changed, Cell(changed.cell))
        buses.serve([successor], {})
        assert link.node is None
        await until(lambda: successor.health().figures["state"] == "good")
        assert [each.node for each in buses.buses] == [127]


async def test_bus_that_is_not_there_is_a_trouble_and_progress_goes_on() -> None:
    plan = planned()
    bus = replace(the_device(plan).bus, interface="no such interface")
    link = CanopenDeviceLink(replace(the_device(plan), bus=bus), Cell(plan.cell))
    async with managed([link]) as buses:
        await until(buses.troubles)
        assert "no such interface" in buses.troubles()[0]
        assert "the CAN bus is away" in str(link.health().figures["reason"])
        before = buses.progress()["CAN manager can1"]
        await until(lambda: buses.progress()["CAN manager can1"] > before)
        buses.gap(0.0, 1.0)


async def test_nothing_is_needed_beforehand() -> None:
    buses = CanopenBuses()
    prepared = await buses.prepare([planned()])
    prepared.commit()
    await prepared.abort()
    task = asyncio.create_task(buses.run())
    await asyncio.sleep(0)
    await buses.close()
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task


async def test_frames_of_a_device_are_traced_by_its_name() -> None:
    """By its PDOs and the predefined connection set; NMT and SYNC concern all devices of the bus."""
    channel = str(uuid4())
    plan = planned(channel=channel)
    link = link_of(plan, Cell(plan.cell))
    moved = replace(the_device(plan).node.pdos[0], cob_id=0x3A0)
    six = replace(the_device(plan), name="six", node=replace(the_device(plan).node, node=6, pdos=(moved,)))
    other = CanopenDeviceLink(replace(six, places=()), Cell(plan.cell))
    async with managed([link, other]) as buses:
        passed: list[Passage] = []
        buses.trace(passed.append)
        tap = link.manager.tap if link.manager is not None else None
        assert tap is not None
        name = link.plan.name
        for can_id, links in ((0x585, (name,)), (0x706, ("six",)), (0x3A0, ("six",)), (0x80, (name, "six"))):
            tap(Frame(can_id, b""), False)
            assert (passed[-1].links, passed[-1].cell) == (links, plan.cell.name)
