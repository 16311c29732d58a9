from __future__ import annotations

import asyncio

from gatewayd.loop import clock
from gatewayd.modbus.client.conversation import TcpConversation
from gatewayd.modbus.client.line import Line, LineSettings
from gatewayd.modbus.client.requests import write_register
from gatewayd.modbus.client.runner import LineError, LineRunner
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.unit import StationSettings, UnitState
from gatewayd.modbus.frames import encode, split
from tests.modbus.client.server import running
from tests.modbus.client.test_tcp import until
from tests.modbus.client.world import Heard, Unit, polls


class Pipe:
    """A connection to a unit in the same loop."""

    def __init__(self, runner: LineRunner, unit: Unit) -> None:
        self._runner, self._unit = runner, unit
        self.is_open = True
        self.is_broken = False

    def send(self, data: bytes) -> None:
        if self.is_broken:
            return
        request = split(bytearray(data), 0, len(data))
        assert request is not None
        answer = self._unit.answer(request.pdu)
        if answer is not None:
            frame = encode(request.transaction, request.unit, answer)
            asyncio.get_running_loop().call_soon(self._deliver, frame)

    def _deliver(self, frame: bytes) -> None:
        self._runner.received(frame)

    def close(self) -> None:
        self.is_open = False


class Runner(LineRunner):
    """Opens pipes; fails as often as it is told."""

    def __init__(self, settings: StationSettings) -> None:
        self.heard, self.unit, self.reports = Heard(), Unit(), list[str]()
        self.station = Station(settings, self.heard)
        super().__init__(Line(LineSettings(max_backoff=0.02), [self.station]), self.reports.append)
        self.pipes: list[Pipe] = []
        self.failures: list[str] = []
        self.stillborn = 0
        """How many connections end before `open` has returned them."""

    async def open(self) -> Pipe:
        if self.failures:
            raise LineError(self.failures.pop(0))
        self.pipes.append(Pipe(self, self.unit))
        if self.stillborn:
            self.stillborn -= 1
            self.pipes[-1].is_broken = True
            self.ended("closed")
        return self.pipes[-1]

    def make_conversation(self) -> TcpConversation:
        return TcpConversation()


async def test_failure_is_reported_once_for_each_reason_and_its_end() -> None:
    runner = Runner(StationSettings(1, polls(0.01)))
    runner.failures = ["no port", "no port", "no right", "no right"]
    async with running(runner):
        await until(lambda: runner.heard.values, "values")
    assert runner.reports == ["no port", "no right", ""]


async def test_write_from_a_listener_goes_out_in_the_same_turn() -> None:
    runner = Runner(StationSettings(1, polls(5.0)))

    def write(key: int) -> None:
        assert runner.station.write(key, write_register(key, b"\0\1"), clock.now())

    def write_next(key: object) -> None:
        if isinstance(key, int) and key < 3:
            write(key + 1)

    runner.heard.when_written = write_next

    async with running(runner):
        await until(lambda: runner.station.state is UnitState.ONLINE, "the unit")
        write(1)
        await until(lambda: len(runner.heard.written) == 3, "all writes")
    assert runner.unit.registers == {1: 1, 2: 1, 3: 1}


async def test_cancellation_closes_the_connection_and_loses_the_units() -> None:
    runner = Runner(StationSettings(1, polls(0.01)))
    async with running(runner):
        await until(lambda: runner.heard.values, "values")
    assert not runner.pipes[0].is_open
    assert runner.heard.states[-1][:2] == (UnitState.LOST, "the line was stopped")
    assert not runner.station.write("a", write_register(0, b"\0\0"), clock.now())


async def test_line_without_units_opens_nothing() -> None:
    runner = Runner(StationSettings(1, polls(0.01)))
    runner.line.remove(runner.station, clock.now())
    async with running(runner):
        progress = runner.progress
        await until(lambda: runner.progress > progress + 1, "progress")
        assert runner.pipes == []


async def test_bytes_of_a_connection_that_was_closed_are_ignored() -> None:
    runner = Runner(StationSettings(1, polls(0.01)))
    async with running(runner):
        await until(lambda: runner.heard.values, "values")
        runner.ended("broken")
        runner.received(b"\xff" * 20)
        await until(lambda: len(runner.pipes) == 2, "another connection")


async def test_broadcast_goes_out_at_once() -> None:
    runner = Runner(StationSettings(1, polls(5.0)))
    async with running(runner):
        await until(lambda: runner.station.state is UnitState.ONLINE, "the unit")
        assert runner.broadcast(write_register(9, b"\0\1"))
        await until(lambda: runner.unit.registers == {9: 1}, "the broadcast")


async def test_connection_that_ends_before_it_is_known_is_opened_again() -> None:
    """A device whose places are all taken accepts and closes at once: nobody hears of that end a second time."""
    runner = Runner(StationSettings(1, polls(0.01)))
    runner.stillborn = 3
    async with running(runner):
        await until(lambda: runner.heard.values, "values")
    assert len(runner.pipes) == 4
    assert runner.reports == ["closed", ""]
