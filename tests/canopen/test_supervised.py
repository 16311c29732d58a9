"""What all drivers do alike."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Iterator

import pytest

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.errors import decode
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.socketcan import SocketCanBus
from gatewayd.canopen.supervised import ROOM_RETRY, SupervisedBus
from gatewayd.canopen.supervision import BusSignal
from gatewayd.loop import clock
from tests.links.canopen_node.recorder import Recorder, until

BUS_OFF = 0x2000_0040
NOBODY_REPORTS = -1


@pytest.fixture
def recorder() -> Recorder:
    return Recorder()


@pytest.fixture
async def bus(recorder: Recorder) -> SupervisedBus:
    bus = SocketCanBus("can0", recorder)
    bus._loop = asyncio.get_running_loop()
    bus._feed(BusSignal.UP, 0.0, "up")
    return bus


@pytest.fixture
def full() -> Iterator[tuple[socket.socket, socket.socket]]:
    """A socket without room, and its other end."""
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    with contextlib.closing(ours), contextlib.closing(theirs):
        with contextlib.suppress(BlockingIOError):
            while True:
                ours.send(bytes(4096))
        yield ours, theirs


async def test_room_is_reported_once_and_when_there_is_some(
    bus: SupervisedBus, recorder: Recorder, full: tuple[socket.socket, socket.socket]
) -> None:
    ours, theirs = full
    bus._wait_for_room(ours.fileno())
    await asyncio.sleep(5 * ROOM_RETRY)
    assert (bus._full, recorder.writable) == (True, 0)
    theirs.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while True:
            theirs.recv(1 << 20)
    await until(lambda: recorder.writable)
    await asyncio.sleep(5 * ROOM_RETRY)
    assert (bus._full, recorder.writable) == (False, 1)


async def test_room_that_nobody_reports_is_tried_after_a_moment(
    bus: SupervisedBus, recorder: Recorder
) -> None:
    bus._wait_for_room(NOBODY_REPORTS)
    assert bus._full
    await until(lambda: recorder.writable)
    assert (bus._full, recorder.writable) == (False, 1)


@pytest.mark.parametrize("kernel_reports", [True, False])
async def test_a_bus_that_carries_nothing_is_not_waited_for(
    bus: SupervisedBus, recorder: Recorder, kernel_reports: bool
) -> None:
    ours, theirs = socket.socketpair()
    with contextlib.closing(ours), contextlib.closing(theirs):
        bus._wait_for_room(ours.fileno() if kernel_reports else NOBODY_REPORTS)
        bus._feed(BusSignal.OFF, 1.0, "off")
        await asyncio.sleep(5 * ROOM_RETRY)
    assert (bus._full, recorder.writable) == (False, 0)


async def test_an_error_frame_is_reported_with_the_state_that_follows(
    bus: SupervisedBus, recorder: Recorder
) -> None:
    report = decode(BUS_OFF, bytes(8))
    bus._hand_over([], [report], 1.0)
    assert recorder.errors == [report]
    assert bus.state is BusState.BUS_OFF
    assert recorder.states == [BusState.ACTIVE, BusState.BUS_OFF]


async def test_a_state_is_reported_when_it_changes(bus: SupervisedBus, recorder: Recorder) -> None:
    bus._feed(BusSignal.UP, 1.0, "still up")
    assert (recorder.states, recorder.reasons) == ([BusState.ACTIVE], ["up"])


def test_what_was_read_while_the_process_was_stopped_is_no_news() -> None:
    """SIGSTOP can come between two frames of one reading: whoever judges the time is called before they are served."""
    order: list[str] = []

    class Handler(Recorder):
        def on_frames(self, frames: list[Frame], now: float) -> None:
            order.append("frames")
            self.at = now

    handler = Handler()

    async def read() -> tuple[float, float]:
        clock.on_gap(lambda _gap: order.append("gap"))
        bus = SocketCanBus("can0", handler)
        before = clock.judged_now()
        time.sleep(2 * clock.GAP)  # noqa: ASYNC251 - as SIGSTOP would: the loop does not turn
        bus._hand_over([Frame(0x201, bytes(8))], [], before)
        return before, handler.at

    with asyncio.Runner(loop_factory=clock.ClockedLoop) as runner:
        before, at = runner.run(read())
    assert order == ["gap", "frames"]
    assert at - before >= 2 * clock.GAP
