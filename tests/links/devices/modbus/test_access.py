"""Who answers on a line, and a place of a device, without a gateway."""

from __future__ import annotations

import os
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from gatewayd.links.access import AccessError, AccessProblem, FoundDevice, PlaceRequest, ScanOrder
from gatewayd.links.devices.modbus.access import ACCESS, ModbusScan, found_device, line_of
from gatewayd.links.devices.modbus.plan import LineAddress, SerialSettings
from gatewayd.links.examination import RunningCell
from gatewayd.modbus.client.identity import UnitIdentity
from tests.e2e.processes import HOST as PROCESS_HOST
from tests.links.devices.cells import HEAD, VARIABLES, device, planned
from tests.modbus.client.server import HOST, Server
from tests.modbus.client.world import Unit
from tests.peers.programs import libmodbus_server, serial_bus, tcp_server

IDENTIFICATION = bytes.fromhex("2b0e01010000030005") + b"Maker" + b"\x01\x02X1\x02\x042.10"


class Named(Unit):
    """A unit with an identification."""

    def _answer(self, pdu: bytes) -> bytes:
        return IDENTIFICATION if pdu[0] == 43 else super()._answer(pdu)


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    served = Server(Named())
    await served.start()
    yield served
    await served.stop()


async def found(scan: ModbusScan) -> tuple[list[FoundDevice], list[int]]:
    devices: list[FoundDevice] = []
    counted: list[int] = []
    async for news in scan.run():
        if isinstance(news, int):
            counted.append(news)
        else:
            devices.append(news)
    return devices, counted


async def test_scan_finds_units_and_what_they_are(server: Server) -> None:
    scan = ACCESS.scan(ScanOrder(f"{HOST}:{server.port}", 3, 5))
    devices, counted = await found(scan)
    assert [(each.number, each.text) for each in devices] == [(n, "Maker X1 2.10") for n in (3, 4, 5)]
    assert devices[0].fields["product_code"] == "X1"
    assert counted == [1, 2, 3]
    assert {request[0] for request in server.unit.requests} == {3, 43}


async def test_scan_goes_on_where_the_device_breaks_the_connection(server: Server) -> None:
    server.closes_after = 2
    devices, counted = await found(ACCESS.scan(ScanOrder(f"{HOST}:{server.port}", 1, 5)))
    assert [each.number for each in devices] == [1, 2, 3, 4, 5]
    assert counted[-1] == 5
    assert server.accepted > 2


async def test_silence_takes_its_bounded_time(server: Server) -> None:
    server.unit.change = lambda _: None
    scan = ACCESS.scan(ScanOrder(f"{HOST}:{server.port}", 1, 3, 0.01))
    assert await found(scan) == ([], [1, 2, 3])
    assert scan.longest == pytest.approx(3.03)


async def test_line_that_cannot_be_used() -> None:
    with pytest.raises(AccessError, match="refused") as raised:
        await found(ACCESS.scan(ScanOrder(f"{HOST}:1", 1, 1)))
    assert raised.value.problem is AccessProblem.UNUSABLE


def test_lines() -> None:
    assert line_of("island.local", {}) == LineAddress("island.local", 502)
    assert line_of("[::1]:5020", {"framing": "rtu"}) == LineAddress("::1", 5020, "rtu")
    expected = LineAddress("/dev/ttyUSB0", framing="rtu", serial=SerialSettings(9600, "even", 2))
    assert line_of("/dev/ttyUSB0", {"baudrate": 9600, "parity": "even", "stop_bits": 2}) == expected


@pytest.mark.parametrize(
    "line, settings, says",
    [
        ("a b", {}, "is not the address of a device"),
        ("island:0", {}, "port 0 is not between"),
        ("/dev/ttyS0", {"framing": "tcp"}, "no --framing"),
        ("island", {"stop_bits": 2}, "no --stop-bits"),
    ],
)
def test_no_line(line: str, settings: dict[str, object], says: str) -> None:
    with pytest.raises(AccessError, match=says):
        line_of(line, settings)


def test_units_have_a_range() -> None:
    assert len(ACCESS.scan(ScanOrder("/dev/ttyS0")).numbers) == 247
    assert ACCESS.scan(ScanOrder(HOST, 0, 255)).numbers == range(256)
    for line, first, last in (("/dev/ttyS0", 0, 3), (HOST, 5, 4), (HOST, 1, 256)):
        with pytest.raises(AccessError, match="are no units of"):
            ACCESS.scan(ScanOrder(line, first, last))


def test_line_of_a_running_gateway(tmp_path: Path) -> None:
    alias = tmp_path / "by-id"
    alias.symlink_to(os.devnull)

    def running(address: str) -> list[RunningCell]:
        status = {"family": "modbus", "address": address, "unit": 9}
        return [RunningCell("/run/s", {"name": "press", "links": [{"name": "gripper"}], "gripper": status})]

    serial = ACCESS.scan(ScanOrder(str(alias)))
    assert "has " in serial.refusal(running(f"{os.devnull} 115200 8N1"))
    assert "gatewayd devices read gripper holding:0" in serial.refusal(running(f"{os.devnull} 115200 8N1"))
    assert serial.refusal(running("/dev/ttyUSB7 115200 8N1")) == ""
    tcp = ACCESS.scan(ScanOrder(HOST))
    assert tcp.refusal(running(f"{HOST}:502")) == ""
    assert "is connected there as well" in tcp.remarks(running(f"{HOST}:502"))[0]
    assert tcp.remarks(running(f"{HOST}:503")) == []
    gripper = device(planned(), "gripper")
    assert "without --mapping" in ACCESS.refusal(gripper, running("/dev/ttyUSB0 115200 8N1"))
    island = device(planned(), "island")
    assert ACCESS.refusal(island, running(f"{HOST}:1503")) == ""
    here = running(f"{HOST}:1503")
    here[0].status["gripper"]["unit"] = 1
    assert "talks to it already" in ACCESS.refusal(island, here)


async def test_place_of_a_device(server: Server) -> None:
    plan = planned(VARIABLES, HEAD.replace("1503", str(server.port)))
    island = device(plan, "island")
    server.unit.registers = {100: 7}
    answer = await ACCESS.ask(island, plan.cell, PlaceRequest("100", value="8"))
    assert (answer.former[0].value, answer.values[0].value) == (7, 8)
    server.unit.change = lambda _: None
    with pytest.raises(AccessError, match="device island does not answer") as raised:
        await ACCESS.ask(island, plan.cell, PlaceRequest("100"))
    assert raised.value.problem is AccessProblem.NO_ANSWER


def test_identity_in_words() -> None:
    assert found_device(4, UnitIdentity()).text == ""
    full = found_device(4, UnitIdentity(((0, "Maker "), (1, "X1"), (2, "2.10"), (4, "Island"), (0x80, "?"))))
    assert full.text == "Maker Island X1 2.10"
    assert full.fields["vendor"] == "Maker "


@pytest.mark.slow
async def test_units_of_libmodbus(tmp_path: Path) -> None:
    """It waits before it refuses the identification, and drops what comes meanwhile: no unit is missed for it."""
    with tcp_server("libmodbus", libmodbus_server(tmp_path), tmp_path) as port:
        devices, _ = await found(ACCESS.scan(ScanOrder(f"{PROCESS_HOST}:{port}", 1, 3)))
    assert [(each.number, each.text) for each in devices] == [(1, ""), (2, ""), (3, "")]


@pytest.mark.slow
async def test_units_on_a_serial_line(tmp_path: Path) -> None:
    with serial_bus(libmodbus_server(tmp_path), (2, 5), 115_200, tmp_path) as bus:
        scan = ACCESS.scan(ScanOrder(bus.names[0], 1, 6, 0.3, {"baudrate": 115_200}))
        devices, _ = await found(scan)
    assert [each.number for each in devices] == [2, 5]
