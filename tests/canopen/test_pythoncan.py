"""Interfaces of python-can: in the process (virtual) and over a serial protocol on TCP (slcan)."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import AsyncIterator
from contextlib import suppress
from uuid import uuid4

import can
import pytest

from gatewayd.canopen.bus import BusError, BusState
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.pythoncan import PythonCanBus
from tests.links.canopen_node.recorder import Recorder, until


class Adapter:
    """A serial CAN adapter (slcan) that listens on TCP."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.reading = asyncio.Event()
        self.reading.set()
        self.port = 0
        self._server: asyncio.Server | None = None
        self._writer: asyncio.StreamWriter | None = None

    async def plug_in(self) -> None:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", self.port, limit=2048)
        self.port = self._server.sockets[0].getsockname()[1]

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writer = writer
        try:
            while True:
                await self.reading.wait()
                self.lines.append((await reader.readuntil(b"\r")).decode().strip())
        except (asyncio.IncompleteReadError, ConnectionError):
            pass

    def say(self, *lines: str) -> None:
        assert self._writer is not None
        self._writer.write("".join(line + "\r" for line in lines).encode())

    async def unplug(self) -> None:
        assert self._server is not None
        self._server.close()
        if self._writer is not None:
            self._writer.transport.abort()
        await asyncio.sleep(0.01)


@pytest.fixture
async def adapter() -> AsyncIterator[Adapter]:
    made = Adapter()
    await made.plug_in()
    yield made
    await made.unplug()


@pytest.fixture
async def virtual() -> AsyncIterator[tuple[PythonCanBus, Recorder, can.BusABC]]:
    """A bus of ours and a plain one on the same channel."""
    channel = str(uuid4())
    recorder = Recorder()
    bus = PythonCanBus("virtual", channel, 500_000, recorder)
    bus.set_filters({0x205, 0x605}, {0x705})
    await bus.open()
    peer = can.Bus(channel, interface="virtual")
    yield bus, recorder, peer
    bus.close()
    peer.shutdown()


@pytest.fixture
async def slcan(adapter: Adapter) -> AsyncIterator[tuple[PythonCanBus, Recorder]]:
    recorder = Recorder()
    bus = PythonCanBus("slcan", f"socket://127.0.0.1:{adapter.port}", 250_000, recorder)
    bus.set_filters({0x205}, {0x705})
    await bus.open()
    yield bus, recorder
    bus.close()


async def test_frames_go_both_ways(virtual: tuple[PythonCanBus, Recorder, can.BusABC]) -> None:
    bus, recorder, peer = virtual
    assert recorder.states == [BusState.ACTIVE]
    peer.send(can.Message(arbitration_id=0x205, data=b"\1\2", is_extended_id=False))
    peer.send(can.Message(arbitration_id=0x705, is_remote_frame=True, dlc=1, is_extended_id=False))
    await until(lambda: len(recorder.frames) == 2)
    assert recorder.frames == [Frame(0x205, b"\1\2"), Frame(0x705, b"", remote=True, length=1)]
    assert bus.send(Frame(0x185, bytes(range(8))))
    assert bus.send(Frame(0x285, remote=True, length=3))
    first, second = peer.recv(1), peer.recv(1)
    assert first is not None
    assert second is not None
    assert (first.arbitration_id, bytes(first.data), first.is_extended_id) == (0x185, bytes(range(8)), False)
    assert (second.arbitration_id, second.is_remote_frame, second.dlc) == (0x285, True, 3)


async def test_only_what_is_wanted_comes_in(virtual: tuple[PythonCanBus, Recorder, can.BusABC]) -> None:
    """Other identifiers, 29-bit ones, remote frames of data identifiers and the other way round stay outside."""
    _, recorder, peer = virtual
    for message in (
        can.Message(arbitration_id=0x206, is_extended_id=False),
        can.Message(arbitration_id=0x205, is_extended_id=True),
        can.Message(arbitration_id=0x205, is_extended_id=False, is_remote_frame=True),
        can.Message(arbitration_id=0x705, is_extended_id=False),
        can.Message(arbitration_id=0x205, is_extended_id=False, is_fd=True),
        can.Message(arbitration_id=0x605, is_extended_id=False),
    ):
        peer.send(message)
    await until(lambda: recorder.frames)
    assert recorder.frames == [Frame(0x605)]


async def test_burst_leaves_the_loop_its_turns(virtual: tuple[PythonCanBus, Recorder, can.BusABC]) -> None:
    _, recorder, peer = virtual
    for number in range(200):
        peer.send(can.Message(arbitration_id=0x205, data=bytes([number]), is_extended_id=False))
    await until(lambda: len(recorder.frames) == 200)
    assert [frame.data[0] for frame in recorder.frames] == list(range(200))
    assert max(recorder.batches) <= 64


async def test_reports_of_the_controller_change_the_state(
    virtual: tuple[PythonCanBus, Recorder, can.BusABC],
) -> None:
    _bus, recorder, peer = virtual
    for can_id, data in ((0x204, [0, 0x20, 0, 0, 0, 0, 130, 7]), (0x040, [0] * 8), (0x100, [0] * 8)):
        peer.send(can.Message(arbitration_id=can_id, data=data, is_error_frame=True, is_extended_id=False))
    await until(lambda: len(recorder.errors) == 3)
    assert recorder.states == [BusState.ACTIVE, BusState.PASSIVE, BusState.BUS_OFF, BusState.ACTIVE]
    assert recorder.errors[0].tx_errors == 130


async def test_no_thread_is_started(virtual: tuple[PythonCanBus, Recorder, can.BusABC]) -> None:
    bus, recorder, peer = virtual
    peer.send(can.Message(arbitration_id=0x205, is_extended_id=False))
    await until(lambda: recorder.frames)
    assert bus.send(Frame(0x185))
    await until(lambda: threading.active_count() == 1)


async def test_nothing_is_sent_after_closing(virtual: tuple[PythonCanBus, Recorder, can.BusABC]) -> None:
    bus, recorder, peer = virtual
    bus.close()
    assert not bus.send(Frame(0x185))
    peer.send(can.Message(arbitration_id=0x205, is_extended_id=False))
    await asyncio.sleep(0.03)
    assert recorder.frames == []


async def test_serial_adapter_both_ways(slcan: tuple[PythonCanBus, Recorder], adapter: Adapter) -> None:
    bus, recorder = slcan
    await until(lambda: "O" in adapter.lines)
    assert "S5" in adapter.lines
    adapter.say("t20521122", "t20600", "r7050")
    await until(lambda: len(recorder.frames) == 2)
    assert recorder.frames == [Frame(0x205, b"\x11\x22"), Frame(0x705, b"", remote=True)]
    assert bus.send(Frame(0x185, b"\xab"))
    await until(lambda: "t1851AB" in adapter.lines)


async def test_adapter_unplugged_and_plugged_in_again(
    slcan: tuple[PythonCanBus, Recorder], adapter: Adapter
) -> None:
    bus, recorder = slcan
    await until(lambda: "O" in adapter.lines)
    await adapter.unplug()
    await until(lambda: bus.state is BusState.ABSENT)
    assert not bus.send(Frame(0x185))
    adapter.lines.clear()
    await adapter.plug_in()
    await until(lambda: bus.state is BusState.ACTIVE)
    await until(lambda: "O" in adapter.lines)
    adapter.say("t2051FF")
    await until(lambda: recorder.frames)
    assert recorder.states == [BusState.ACTIVE, BusState.ABSENT, BusState.ACTIVE]


@pytest.mark.parametrize("nonsense", ["t", "t205", "t2058zz", "tXYZ8", "T0000"])
async def test_nonsense_of_an_adapter_costs_the_connection_and_no_more(
    slcan: tuple[PythonCanBus, Recorder], adapter: Adapter, nonsense: str
) -> None:
    """What came before is received, no exception reaches the loop, and the bus comes back."""
    bus, recorder = slcan
    unhandled: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _loop, context: unhandled.append(context))
    await until(lambda: "O" in adapter.lines)
    adapter.say("t2051FF", nonsense)
    await until(lambda: BusState.ABSENT in recorder.states)
    await until(lambda: bus.state is BusState.ACTIVE)
    assert recorder.frames == [Frame(0x205, b"\xff")]
    assert unhandled == []


async def test_a_lost_adapter_does_not_stop_the_loop(
    slcan: tuple[PythonCanBus, Recorder], adapter: Adapter, monkeypatch: pytest.MonkeyPatch
) -> None:
    """pySerial sleeps when a port is closed that is a connection: longer than a robot may be silent."""
    bus, _recorder = slcan
    slept: list[float] = []
    monkeypatch.setattr("time.sleep", slept.append)
    await until(lambda: "O" in adapter.lines)
    await adapter.unplug()
    await until(lambda: bus.state is BusState.ABSENT)
    await adapter.plug_in()
    await until(lambda: bus.state is BusState.ACTIVE)
    bus.close()
    assert [seconds for seconds in slept if seconds] == []


async def test_adapter_that_takes_nothing_does_not_stop_the_loop(
    slcan: tuple[PythonCanBus, Recorder], adapter: Adapter
) -> None:
    bus, recorder = slcan
    await until(lambda: "O" in adapter.lines)
    adapter.reading.clear()
    sent = 0
    async with asyncio.timeout(60):
        while bus.send(Frame(0x185, bytes(8))):
            sent += 1
            if sent % 512 == 0:
                await asyncio.sleep(0)
    assert not bus.send(Frame(0x185))
    assert recorder.writable == 0
    adapter.reading.set()
    await until(lambda: recorder.writable == 1)
    assert bus.send(Frame(0x185))
    await until(lambda: adapter.lines.count("t1858" + 16 * "0") == sent, 60)


async def test_adapter_that_is_not_there_yet_is_waited_for(adapter: Adapter) -> None:
    await adapter.unplug()
    recorder = Recorder()
    bus = PythonCanBus("slcan", f"socket://127.0.0.1:{adapter.port}", 250_000, recorder)
    await bus.open()
    try:
        assert bus.state is BusState.ABSENT
        await adapter.plug_in()
        await until(lambda: bus.state is BusState.ACTIVE)
    finally:
        bus.close()


async def test_an_adapter_that_does_not_answer_holds_up_nobody() -> None:
    """Its host swallows the attempts to connect, for which pySerial waits five seconds each."""
    with socket.socket() as full, socket.socket() as first, socket.socket() as second:
        full.bind(("127.0.0.1", 0))
        full.listen(0)
        for peer in (first, second):
            peer.setblocking(False)
            peer.connect_ex(full.getsockname())
        bus = PythonCanBus("slcan", f"socket://127.0.0.1:{full.getsockname()[1]}", 250_000, Recorder())
        opening = asyncio.create_task(bus.open())
        longest, before = 0.0, time.monotonic()
        for _ in range(20):
            await asyncio.sleep(0.01)
            longest, before = max(longest, time.monotonic() - before), time.monotonic()
        assert not opening.done()
        assert longest < 1
        opening.cancel()
        with suppress(asyncio.CancelledError):
            await opening
        bus.close()


@pytest.mark.parametrize(
    "interface, channel, bitrate, words",
    [
        ("no-such-interface", "can0", 500_000, "cannot use the interface no-such-interface"),
        ("slcan", "loop://", 123, "slcan refuses channel loop:// at 123 bit/s"),
    ],
)
async def test_what_waiting_cannot_mend_is_said_at_once(
    interface: str, channel: str, bitrate: int, words: str
) -> None:
    bus = PythonCanBus(interface, channel, bitrate, Recorder())
    with pytest.raises(BusError, match=words):
        await bus.open()
    bus.close()
