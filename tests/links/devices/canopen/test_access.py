"""Who answers on a CAN bus, and an object of a device, without a gateway. Nodes are durand's and python-canopen's."""

from __future__ import annotations

from uuid import uuid4

import canopen
import pytest

from gatewayd.links.access import AccessError, AccessProblem, FoundDevice, PlaceRequest, ScanOrder
from gatewayd.links.devices.access import ACCESS as ANY
from gatewayd.links.devices.canopen.access import ACCESS, CanopenScan
from gatewayd.links.examination import RunningCell
from tests.links.devices.canopen.cells import SHEET, an_encoder, planned, the_device


@pytest.fixture
def channel() -> str:
    return str(uuid4())


def order(channel: str, first: int | None = None, last: int | None = None) -> ScanOrder:
    return ScanOrder(channel, first, last, 0.05, {"interface": "virtual"})


async def found(scan: CanopenScan) -> tuple[list[FoundDevice], list[int]]:
    devices: list[FoundDevice] = []
    counted: list[int] = []
    async for news in scan.run():
        if isinstance(news, int):
            counted.append(news)
        else:
            devices.append(news)
    return devices, counted


async def test_scan_finds_nodes_and_what_they_are(channel: str) -> None:
    """One of durand, and one of python-canopen with a thread of its own."""
    network = canopen.Network()
    network.connect(interface="virtual", channel=channel)
    network.create_node(42, str(SHEET))
    try:
        async with an_encoder(channel) as encoder:
            before = encoder.node.nmt.state
            devices, counted = await found(ACCESS.scan(order(channel)))
            assert encoder.node.nmt.state == before
    finally:
        network.disconnect()
    assert [each.number for each in devices] == [5, 42]
    assert devices[0].text.startswith("type 00020196h, vendor 000001F0h, product 00000401h")
    assert devices[0].fields["vendor"] == 0x1F0
    assert counted == [16, 32, 48, 64, 80, 96, 112, 127]


async def test_nobody(channel: str) -> None:
    scan = ACCESS.scan(order(channel, 1, 20))
    assert await found(scan) == ([], [16, 20])
    assert scan.longest == pytest.approx(2.1)


async def test_bus_that_cannot_be_used() -> None:
    for line in (ScanOrder("can123"), ScanOrder("x", settings={"interface": "no-such-interface"})):
        with pytest.raises(AccessError) as raised:
            await found(ACCESS.scan(line))
        assert raised.value.problem is AccessProblem.UNUSABLE


def test_nodes_have_a_range() -> None:
    for first, last in ((0, 5), (1, 128), (9, 3)):
        with pytest.raises(AccessError, match="are no node-IDs"):
            ACCESS.scan(order("can0", first, last))


def test_lines_of_can() -> None:
    for line in ("can0", "vcan1", "slcan0"):
        assert ANY.scan(ScanOrder(line)).noun == "node"
    assert ANY.scan(ScanOrder("fieldbus", settings={"interface": "socketcan"})).noun == "node"
    for line in ("canteen", "can0:502", "/dev/can0"):
        assert ANY.scan(ScanOrder(line)).noun == "unit"
    with pytest.raises(AccessError, match="can0 is no line that has --baudrate"):
        ANY.scan(ScanOrder("can0", settings={"baudrate": 9600}))


def test_bus_of_a_running_gateway() -> None:
    device = {"family": "canopen", "address": "socketcan:can1"}
    status = {"name": "press", "links": [{"name": "encoder", "title": "device"}], "encoder": device}
    managed = [RunningCell("/run/s", status)]
    assert "manages that bus" in ACCESS.scan(ScanOrder("can1")).refusal(managed)
    assert ACCESS.scan(ScanOrder("can0")).refusal(managed) == ""
    own_bus = [RunningCell("/run/s", {**status, "encoder": {**device, "address": "virtual:can1"}})]
    assert "without --mapping" in ACCESS.refusal(the_device(planned()), own_bus)
    assert ACCESS.refusal(the_device(planned()), managed) == ""
    node = {"name": "canopen", "title": "CANopen node"}
    own = RunningCell("/run/s", {"name": "press", "links": [node], "canopen": {"channel": "socketcan:can0"}})
    assert "is a node of that bus" in ACCESS.scan(ScanOrder("can0")).remarks([own])[0]
    assert ACCESS.scan(ScanOrder("can1")).remarks([own]) == []


async def test_object_of_a_device(channel: str) -> None:
    plan = planned(channel=channel)
    device = the_device(plan)
    async with an_encoder(channel) as encoder:
        answer = await ACCESS.ask(device, plan.cell, PlaceRequest("0x6004"))
        assert answer.values[0].value == 1500
        answer = await ACCESS.ask(device, plan.cell, PlaceRequest("0x1017", value="250"))
        assert (answer.former[0].value, answer.values[0].value) == (0, 250)
        with pytest.raises(AccessError, match="gatewayd force preset VALUE"):
            await ACCESS.ask(device, plan.cell, PlaceRequest("0x2000", value="1"))
        assert encoder.get(0x2000) == 41
