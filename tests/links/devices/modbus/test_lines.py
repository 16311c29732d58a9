"""Connections that devices share: they come and go with the devices, and one device's with no other."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Awaitable, Callable
from contextlib import suppress

import pytest

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Passage
from gatewayd.links.devices.modbus.lines import ModbusLines, settings_of
from gatewayd.links.devices.modbus.link import ModbusDeviceLink
from gatewayd.modbus.client.line import ConnectionUse
from gatewayd.modbus.client.unit import UnitState
from tests.links.devices.cells import FakeRobot, device, planned

HEAD = """\
gatewayd: 1
cell: press
robot: {{host: 127.0.0.1}}
devices:
  one: {{modbus: '127.0.0.1:{port}', unit: 1, poll: 10ms, watchdog: none}}
  two: {{modbus: '127.0.0.1:{port}', unit: 2, poll: 10ms, watchdog: none{more}}}
writers:
  one: {{device: one}}
  two: {{device: two}}
variables:
"""
LINES = "".join(
    f"  {name}: {{robot: input_int_register_{n}, device: {{at: {name}, holding: 0, type: uint16}}, owner: {name}}}\n"
    for n, name in enumerate(("one", "two"))
)


class Units:
    """A server that says the unit's number for each register; counts connections and units."""

    def __init__(self) -> None:
        self.connections = 0
        self.asked: list[int] = []
        self.closes = False
        """Whether it closes a connection after its first answer."""

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.connections += 1
        with suppress(asyncio.IncompleteReadError, ConnectionError):
            while True:
                transaction, _, length, unit = struct.unpack(">HHHB", await reader.readexactly(7))
                await reader.readexactly(length - 1)
                self.asked.append(unit)
                writer.write(struct.pack(">HHHBBBH", transaction, 0, 5, unit, 3, 2, unit))
                if self.closes:
                    break
        writer.close()


class Rig:
    def __init__(self, port: int, more: str = "") -> None:
        self.plan = planned(LINES, HEAD.format(port=port, more=more))
        self.robot = FakeRobot(self.plan)
        self.robot.fresh()
        self.links = {name: self.link(name) for name in ("one", "two")}

    def link(self, name: str) -> ModbusDeviceLink:
        return ModbusDeviceLink(device(self.plan, name), self.robot.cell)


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(5):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.002)


def played(scenario: Callable[[Units, Rig, ModbusLines], Awaitable[None]], more: str = "") -> None:
    """Run a scenario with a server and lines at work."""

    async def play() -> None:
        units = Units()
        server = await asyncio.start_server(units.serve, "127.0.0.1", 0)
        async with server:
            rig, lines = Rig(server.sockets[0].getsockname()[1], more), ModbusLines()
            lines.serve(list(rig.links.values()), {})
            running = asyncio.create_task(lines.run())
            try:
                await scenario(units, rig, lines)
            finally:
                await lines.close()
                running.cancel()
                with suppress(asyncio.CancelledError):
                    await running

    asyncio.run(play())


def test_devices_at_one_address_share_a_connection() -> None:
    async def scenario(units: Units, rig: Rig, lines: ModbusLines) -> None:
        await until(lambda: (rig.robot.value("one"), rig.robot.value("two")) == (1, 2))
        assert units.connections == 1
        assert [count > 0 for count in lines.progress().values()] == [True]

    played(scenario)


def test_a_device_that_goes_leaves_the_other_as_it_is() -> None:
    async def scenario(units: Units, rig: Rig, lines: ModbusLines) -> None:
        await until(lambda: rig.robot.value("two") == 2)
        lines.serve([rig.links["one"]], {})
        assert rig.links["two"].station.state is UnitState.LOST
        asked = len(units.asked)
        await until(lambda: len(units.asked) > asked + 3)
        assert set(units.asked[asked + 1 :]) == {1}
        assert (units.connections, rig.links["one"].station.state) == (1, UnitState.ONLINE)
        # The other one comes back as another link.
        lines.serve([rig.links["one"], rig.link("two")], {})
        await until(lambda: units.asked[-1] == 2)
        assert (units.connections, rig.links["one"].station.counters.losses) == (1, 0)

    played(scenario)


def test_a_time_in_which_the_process_stood_still_is_no_silence_of_a_device() -> None:
    async def scenario(_units: Units, rig: Rig, lines: ModbusLines) -> None:
        station = rig.links["one"].station
        await until(lambda: station.state is UnitState.ONLINE)
        before = station.deadline
        lines.gap(100.0, 105.0)
        assert station.deadline == before + 5

    played(scenario)


def test_no_device_no_connection() -> None:
    async def scenario(units: Units, rig: Rig, lines: ModbusLines) -> None:
        await until(lambda: rig.robot.value("one") == 1)
        lines.serve([], {})
        assert lines.progress() == {}
        asked = len(units.asked)
        await asyncio.sleep(0.03)
        assert len(units.asked) <= asked + 1

    played(scenario)


def test_what_they_share_changes_for_all() -> None:
    async def scenario(units: Units, rig: Rig, lines: ModbusLines) -> None:
        await until(lambda: rig.robot.value("two") == 2)
        lines.serve([rig.links["one"]], {})
        await until(lambda: units.connections == 2 and rig.links["one"].station.state is UnitState.ONLINE)

    played(scenario, ", in_flight: 4")


def test_frames_can_be_traced() -> None:
    async def scenario(_units: Units, rig: Rig, lines: ModbusLines) -> None:
        passed: list[Passage] = []
        lines.trace(passed.append)
        await until(lambda: len(passed) > 4)
        lines.trace(None)
        assert {passage.peer for passage in passed} == {rig.links["one"].plan.line.text}
        assert {passage.outgoing for passage in passed} == {True, False}
        assert all(len(passage.data) in (11, 12) for passage in passed)
        # The unit is the seventh byte: each frame concerns the device that has it.
        assert {(passage.data[6], passage.cell, passage.links) for passage in passed} == {
            (1, "press", ("one",)),
            (2, "press", ("two",)),
        }

    played(scenario)


def test_a_device_that_closes_after_each_answer_is_told_of_with_the_key_that_helps() -> None:
    async def scenario(units: Units, _rig: Rig, lines: ModbusLines) -> None:
        await until(lambda: len(units.asked) > 20)
        assert lines.troubles() == []
        units.closes = True
        await until(lambda: bool(lines.troubles()))
        (trouble,) = lines.troubles()
        assert trouble.endswith(
            ": the device closes the connection after each answer; set `connect: per_request` at `one` and `two`"
        )
        units.closes = False
        await until(lambda: lines.troubles() == [])

    played(scenario)


def test_a_connection_for_each_request_is_no_trouble() -> None:
    async def scenario(units: Units, _rig: Rig, lines: ModbusLines) -> None:
        units.closes = True
        await until(lambda: len(units.asked) > 10)
        assert lines.troubles() == []

    played(scenario, ", connect: per_request")


@pytest.mark.parametrize(
    "is_rtu, outgoing, frame, links",
    [
        (False, True, "0009 0000 0006 07 03 0000 0001", ("one", "two")),
        (True, True, "02 03 0000 0001 0000", ("two",)),
        # A piece of a serial answer is that of the device that was asked last, whatever it begins with.
        (True, False, "01 03 02", ("two",)),
    ],
)
def test_a_frame_concerns_the_devices_of_its_unit_or_all_of_the_line(
    is_rtu: bool, outgoing: bool, frame: str, links: tuple[str, ...]
) -> None:
    async def scenario(_units: Units, rig: Rig, lines: ModbusLines) -> None:
        await until(lambda: rig.robot.value("two") == 2)
        passed: list[Passage] = []
        (line,) = lines.lines.values()
        lines.trace(passed.append)
        line.runner.is_rtu = is_rtu
        line.runner.sent(bytes((2, 3, 0, 0, 0, 1, 2)))
        if outgoing:
            line.runner.sent(bytes.fromhex(frame))
        else:
            line.runner.received(bytes.fromhex(frame))
        assert passed[-1].links == links

    played(scenario)


@pytest.mark.parametrize(
    "more, in_flight, use",
    [
        ("", 1, ConnectionUse.KEPT),
        (", in_flight: 4", 4, ConnectionUse.KEPT),
        (", connect: per_request", 1, ConnectionUse.PER_REQUEST),
    ],
)
def test_the_most_demanding_device_decides(more: str, in_flight: int, use: ConnectionUse) -> None:
    found = settings_of(list(Rig(1, more).links.values()))
    assert (found.in_flight, found.use) == (in_flight, use)


def test_nothing_is_opened_beforehand() -> None:
    async def scenario() -> None:
        lines = ModbusLines()
        prepared = await lines.prepare([])
        prepared.commit()
        await prepared.abort()
        assert lines.lines == {}

    asyncio.run(scenario())


def test_a_cell_of_its_own_is_no_matter() -> None:
    """Two cells with a device each at one address have one line."""
    rig, other = Rig(1), Rig(1)
    lines = ModbusLines()
    lines.serve([rig.links["one"], other.links["two"]], {})
    assert len(lines.lines) == 1
    assert isinstance(rig.robot.cell, Cell)


def test_the_end_of_the_gateway_is_no_loss_of_a_device(caplog: pytest.LogCaptureFixture) -> None:
    async def scenario(_units: Units, rig: Rig, lines: ModbusLines) -> None:
        await until(lambda: (rig.robot.value("one"), rig.robot.value("two")) == (1, 2))
        await lines.close()
        assert rig.links["one"].station.state is UnitState.LOST

    played(scenario)
    assert [record.getMessage() for record in caplog.records if record.levelname == "WARNING"] == []
