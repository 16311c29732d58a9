"""The fast path on a real SocketCAN: what the kernel filters, loses, takes down and brings back."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest

from gatewayd.canopen.bus import BusError, BusState
from gatewayd.canopen.errors import ErrorClass
from gatewayd.canopen.frame import Frame, Priority
from gatewayd.canopen.queue import Transmitter
from gatewayd.canopen.socketcan import SEND_BUFFER, SocketCanBus
from gatewayd.loop import clock
from tests.kernel.bench import Peer, SerialAdapter, ip
from tests.links.canopen_node.recorder import Recorder, until

SATURATED = 9009
"""Frames that a bus of 1 Mbit/s carries in a second: eight bytes, 111 bits without stuffing."""
SO_MEMINFO = 55
FRAME_IN_KERNEL = 768
"""Bytes that a frame occupies in the send buffer."""


class Station:
    """A driver on an interface, with what it reported."""

    def __init__(self, name: str) -> None:
        self.recorder = Recorder()
        self.bus = SocketCanBus(name, self.recorder)

    async def become(self, state: BusState) -> None:
        await until(lambda: self.bus.state is state)

    async def frames(self, count: int) -> list[Frame]:
        await until(lambda: len(self.recorder.frames) >= count, 30)
        return self.recorder.frames


@contextlib.asynccontextmanager
async def opened(name: str, *can_ids: int, remote: tuple[int, ...] = ()) -> AsyncIterator[Station]:
    station = Station(name)
    station.bus.set_filters(can_ids, remote)
    await station.bus.open()
    try:
        yield station
    finally:
        station.bus.close()


@contextlib.contextmanager
def peer_on(name: str) -> Iterator[Peer]:
    peer = Peer(name)
    try:
        yield peer
    finally:
        peer.close()


async def test_only_own_cob_ids_leave_the_kernel(vcan: str) -> None:
    async with opened(vcan, 0x000, 0x205, 0x605, remote=(0x705,)) as station:
        with peer_on(vcan) as peer:
            for can_id in range(0x800):
                peer.send_raw(can_id, b"\1")
                peer.send_raw(can_id | 0x4000_0000, b"")
                peer.send_raw(can_id | 0x8000_0000, b"\1")
            peer.send(Frame(0x000, b"end"))
            assert await station.frames(5) == [
                Frame(0x000, b"\1"),
                Frame(0x205, b"\1"),
                Frame(0x605, b"\1"),
                Frame(0x705, b"", remote=True),
                Frame(0x000, b"end"),
            ]


async def test_filters_change_on_the_open_bus(vcan: str) -> None:
    async with opened(vcan) as station:
        with peer_on(vcan) as peer:
            peer.send(Frame(0x205, b"before"))
            await asyncio.sleep(0.1)
            station.bus.set_filters({0x205})
            peer.send(Frame(0x205, b"after"))
            assert await station.frames(1) == [Frame(0x205, b"after")]


async def test_frames_leave_as_they_were_given(vcan: str) -> None:
    async with opened(vcan) as station:
        with peer_on(vcan) as peer:
            frames = [Frame(0x185, bytes(range(8))), Frame(0x80), Frame(0x705, remote=True, length=1)]
            for frame in frames:
                assert station.bus.send(frame)
            received: list[Frame] = []

            def complete() -> bool:
                received.extend(peer.received())
                return len(received) == len(frames)

            await until(complete)
            assert received == [*frames[:2], Frame(0x705, b"", remote=True, length=1)]


async def test_two_cells_of_one_machine_hear_each_other(vcan: str) -> None:
    async with opened(vcan, 0x701) as one, opened(vcan, 0x702) as other:
        assert one.bus.send(Frame(0x702, b"\5"))
        assert await other.frames(1) == [Frame(0x702, b"\5")]
        assert one.recorder.frames == []


async def test_lost_frames_are_counted(vcan: str) -> None:
    """Every frame is received or counted as lost, the last ones too."""
    async with opened(vcan, 0x205) as station:
        assert station.bus._socket is not None
        receive_buffer = station.bus._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
        assert receive_buffer >= 212_992
        sent = receive_buffer // 500
        with peer_on(vcan) as peer:
            for _ in range(sent):
                peer.send(Frame(0x205, bytes(8)))
            await until(lambda: station.recorder.lost)
            await until(lambda: len(station.recorder.frames) + station.recorder.lost == sent)


async def test_saturated_bus_without_a_lost_frame(vcan: str) -> None:
    """A second of a full bus of 1 Mbit/s, from another process in slots of 10 ms."""
    program = Path(__file__).with_name("saturate.py")
    async with opened(vcan, 0x205) as station:
        start = time.monotonic()
        process = subprocess.Popen(  # noqa: ASYNC220 - starting it is quick
            [sys.executable, program, vcan, str(SATURATED)]
        )
        await until(lambda: process.poll() is not None, 30)
        seconds = time.monotonic() - start
        assert process.returncode == 0
        frames = station.recorder.frames
        await until(lambda: len(frames) + station.recorder.lost == SATURATED)
        assert station.recorder.lost == 0
        assert [int.from_bytes(frame.data, "little") for frame in frames] == list(range(SATURATED))
        print(f"{SATURATED / seconds:.0f} frames/s, {max(station.recorder.batches)} at once")


async def test_interface_taken_down_and_brought_up_again(vcan: str) -> None:
    async with opened(vcan, 0x205) as station:
        first = station.bus._socket
        ip("link", "set", vcan, "down")
        await station.become(BusState.DOWN)
        assert not station.bus.send(Frame(0x185))
        assert "down" in station.recorder.reasons[-1]
        ip("link", "set", vcan, "up")
        await station.become(BusState.ACTIVE)
        with peer_on(vcan) as peer:
            peer.send(Frame(0x205, b"\1"))
            assert await station.frames(1) == [Frame(0x205, b"\1")]
        assert station.bus.send(Frame(0x185))
        assert station.bus._socket is first


async def test_a_failed_send_shows_before_the_next_look(vcan: str) -> None:
    async with opened(vcan) as station:
        ip("link", "set", vcan, "down")
        assert not station.bus.send(Frame(0x185))
        assert station.bus.state is BusState.DOWN
        ip("link", "delete", vcan)
        await station.become(BusState.ABSENT)


async def test_interface_that_comes_goes_and_comes_again(vcan: str) -> None:
    ip("link", "delete", vcan)
    async with opened(vcan, 0x205) as station:
        assert station.bus.state is BusState.ABSENT
        for number in range(2):
            ip("link", "add", vcan, "type", "vcan")
            await station.become(BusState.DOWN)
            ip("link", "set", vcan, "up")
            await station.become(BusState.ACTIVE)
            with peer_on(vcan) as peer:
                peer.send(Frame(0x205, bytes([number])))
                assert (await station.frames(number + 1))[-1] == Frame(0x205, bytes([number]))
            ip("link", "delete", vcan)
            await station.become(BusState.ABSENT)


async def test_interface_replaced_between_two_looks(vcan: str) -> None:
    """The new one has the same name, but is another one."""
    async with opened(vcan, 0x205) as station:
        first = station.bus._index
        ip("link", "delete", vcan)
        ip("link", "add", vcan, "type", "vcan")
        ip("link", "set", vcan, "up")
        await until(lambda: station.bus._index not in (0, first))
        with peer_on(vcan) as peer:
            peer.send(Frame(0x205, b"\1"))
            assert await station.frames(1) == [Frame(0x205, b"\1")]


async def test_what_is_no_can_interface_is_refused() -> None:
    bus = SocketCanBus("lo", Recorder())
    with pytest.raises(BusError, match="lo is not a CAN interface"):
        await bus.open()


async def test_error_frame_of_the_wire_changes_no_state(vcan: str) -> None:
    async with opened(vcan) as station:
        with peer_on(vcan) as peer:
            peer.send_raw(0x2000_0088, bytes([0, 0, 4, 10, 0, 0, 0, 0]))
            await until(lambda: station.recorder.errors)
        assert station.recorder.errors[0].classes == ErrorClass.PROTOCOL | ErrorClass.BUS_ERROR
        assert station.recorder.states == [BusState.ACTIVE]


async def test_controller_tells_its_bit_rate_and_counters(adapter: SerialAdapter) -> None:
    async with opened(adapter.name, 0x123) as station:
        assert station.bus.bitrate == 500_000
        adapter.say("sw100090")
        await until(lambda: station.recorder.errors)
        report = station.recorder.errors[-1]
        assert (report.rx_errors, report.tx_errors) == (100, 90)


async def test_controller_gets_worse_and_better(adapter: SerialAdapter) -> None:
    async with opened(adapter.name, 0x123) as station:
        for report, state in (
            ("sw100120", BusState.WARNING),
            ("sp130140", BusState.PASSIVE),
            ("sw100090", BusState.WARNING),
            ("sa010010", BusState.ACTIVE),
        ):
            adapter.say(report)
            await station.become(state)
        adapter.say("t12321122")
        assert await station.frames(1) == [Frame(0x123, b"\x11\x22")]
        assert len(station.recorder.errors) == 4


async def test_bus_off_takes_no_frame_and_is_left_by_down_and_up(adapter: SerialAdapter) -> None:
    async with opened(adapter.name, 0x123) as station:
        assert station.bus.send(Frame(0x185, b"\1"))
        await until(lambda: "t185101" in adapter.lines)
        adapter.say("sb000256")
        await station.become(BusState.BUS_OFF)
        assert not station.bus.send(Frame(0x185, b"\2"))
        await asyncio.sleep(0.3)
        assert station.bus.state is BusState.BUS_OFF
        await adapter.down()
        await station.become(BusState.DOWN)
        await adapter.up()
        await station.become(BusState.ACTIVE)
        assert station.bus.send(Frame(0x185, b"\3"))
        await until(lambda: "t185103" in adapter.lines)
        assert "t185102" not in adapter.lines
        assert station.recorder.states.count(BusState.BUS_OFF) == 1


async def test_bus_off_is_seen_when_the_daemon_starts(adapter: SerialAdapter) -> None:
    """No error frame says anything of what was before."""
    adapter.say("sb000256")
    await asyncio.sleep(0.1)
    async with opened(adapter.name) as station:
        assert station.recorder.states == [BusState.BUS_OFF]
        assert "restart-ms is not set" in station.recorder.reasons[0]


async def test_adapter_unplugged_and_plugged_in_again(adapter: SerialAdapter) -> None:
    async with opened(adapter.name, 0x123) as station:
        name = adapter.name
        adapter.unplug()
        await station.become(BusState.ABSENT)
        assert not station.bus.send(Frame(0x185))
        adapter.plug_in()
        assert adapter.name == name
        await adapter.configure(250_000)
        await station.become(BusState.DOWN)
        await adapter.up()
        await station.become(BusState.ACTIVE)
        assert station.bus.bitrate == 250_000
        adapter.say("t1231AA")
        assert await station.frames(1) == [Frame(0x123, b"\xaa")]


@pytest.mark.parametrize("queue", [10, 1])
async def test_full_queue_of_the_kernel_loses_nothing(adapter: SerialAdapter, queue: int) -> None:
    """With the usual queue the kernel reports when there is room (EAGAIN), with a short one nobody does (ENOBUFS)."""
    await adapter.down()
    await adapter.set_queue_length(queue)
    await adapter.up()
    async with opened(adapter.name) as station:
        await station.become(BusState.ACTIVE)
        transmitter = Transmitter(station.bus.send, lambda _can_id: None, now=clock.now)
        transmitter.open()
        station.recorder.room = transmitter.flush
        adapter.stop_reading()
        number = 0
        while not transmitter.queue:
            transmitter.send(Frame(0x581, number.to_bytes(2, "big")), Priority.ORDERED)
            number += 1
        for _ in range(100):
            transmitter.send(Frame(0x581, number.to_bytes(2, "big")), Priority.ORDERED)
            number += 1
        await asyncio.sleep(0.05)
        adapter.read()
        expected = [f"t5812{n:04X}" for n in range(number)]
        await until(lambda: len([line for line in adapter.lines if line.startswith("t")]) == number)
        assert [line for line in adapter.lines if line.startswith("t")] == expected
        assert transmitter.queue.overflow == 0


async def test_only_few_frames_wait_in_the_kernel(adapter: SerialAdapter) -> None:
    """What waits there cannot be replaced by something newer any more: some six frames besides the terminal's."""
    async with opened(adapter.name) as station:
        kernel = station.bus._socket
        assert kernel is not None
        assert kernel.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) == 2 * SEND_BUFFER
        adapter.stop_reading()
        while station.bus.send(Frame(0x185, bytes(8))):
            pass
        unsent = struct.unpack_from("=3I", kernel.getsockopt(socket.SOL_SOCKET, SO_MEMINFO, 36))[2]
        assert 4 <= unsent // FRAME_IN_KERNEL <= 8
        adapter.read()
