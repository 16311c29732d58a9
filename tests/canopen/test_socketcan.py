"""The fast path without a CAN kernel: layouts, batches, judgements. On a real SocketCAN: tests/kernel."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import struct
from collections.abc import Iterator

import pytest

from gatewayd.canopen.bus import DRAIN, BusError, BusState
from gatewayd.canopen.errors import ErrorClass
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.interface import ControllerState, Interface
from gatewayd.canopen.socketcan import SocketCanBus, filters, no_socketcan, pack, seen
from gatewayd.canopen.supervision import BusSignal
from tests.links.canopen_node.recorder import Recorder


def test_frame_layout() -> None:
    assert pack(Frame(0x185, b"\1\2")) == struct.pack("=I", 0x185) + bytes(
        [2, 0, 0, 0, 1, 2, 0, 0, 0, 0, 0, 0]
    )
    assert pack(Frame(0x705, remote=True, length=1)) == struct.pack("=I", 0x4000_0705) + bytes([1]) + bytes(
        11
    )


def test_filters_are_exact_in_all_bits() -> None:
    assert filters([0x205, 0x000], [0x705]) == struct.pack(
        "=6I", 0x000, 0xC000_07FF, 0x205, 0xC000_07FF, 0x4000_0705, 0xC000_07FF
    )


def test_more_filters_than_the_kernel_takes_become_one() -> None:
    assert len(filters(range(512), [])) == 512 * 8
    assert filters(range(513), []) == struct.pack("=II", 0, 0x8000_0000)


@pytest.mark.parametrize(
    "interface, event",
    [
        (None, BusSignal.GONE),
        (Interface(3, True, False, True, ControllerState.STOPPED), BusSignal.DOWN),
        (Interface(3, True, True, False, ControllerState.BUS_OFF), BusSignal.OFF),
        (Interface(3, True, True, True, ControllerState.PASSIVE), BusSignal.PASSIVE),
        (Interface(3, True, True, True), BusSignal.UP),
    ],
)
def test_what_a_look_means(interface: Interface | None, event: BusSignal) -> None:
    assert seen("can0", interface)[0] is event


@pytest.fixture
def wire() -> Iterator[tuple[SocketCanBus, Recorder, socket.socket]]:
    """A bus whose socket is one end of a pair that keeps the borders of messages, as a CAN socket does."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    ours.setblocking(False)
    recorder = Recorder()
    bus = SocketCanBus("can0", recorder)
    bus._socket = ours
    bus._supervisor.feed(BusSignal.UP)
    with contextlib.closing(ours), contextlib.closing(theirs):
        yield bus, recorder, theirs


def test_one_wake_up_reads_no_more_than_a_batch(wire: tuple[SocketCanBus, Recorder, socket.socket]) -> None:
    bus, recorder, theirs = wire
    for number in range(DRAIN + 5):
        theirs.send(pack(Frame(0x205, bytes([number]))))
    bus._readable()
    bus._readable()
    assert recorder.batches == [DRAIN, 5]
    assert recorder.frames == [Frame(0x205, bytes([number])) for number in range(DRAIN + 5)]


@pytest.mark.parametrize("place", [0, 1])
def test_kinds_of_frames_are_separated_wherever_they_stand(
    wire: tuple[SocketCanBus, Recorder, socket.socket], place: int
) -> None:
    bus, recorder, theirs = wire
    special = [
        struct.pack("=IB3x8s", 0x4000_0705, 1, b""),
        struct.pack("=IB3x8s", 0x8000_0205, 8, b"foreign!"),
        struct.pack("=IB3x8s", 0x2000_0040, 8, b""),
    ]
    for raw in special:
        for message in [pack(Frame(0x205, b"\1"))] * place + [raw]:
            theirs.send(message)
        bus._readable()
    assert recorder.frames == [Frame(0x205, b"\1")] * place + [
        Frame(0x705, b"", remote=True, length=1),
        *[Frame(0x205, b"\1")] * (2 * place),
    ]
    assert [error.classes for error in recorder.errors] == [ErrorClass.BUS_OFF]
    assert recorder.states == [BusState.BUS_OFF]


def test_nothing_is_handed_to_a_kernel_that_would_swallow_it(
    wire: tuple[SocketCanBus, Recorder, socket.socket],
) -> None:
    """In bus-off the kernel takes frames and sends none."""
    bus, _, theirs = wire
    assert bus.send(Frame(0x185, b"\1"))
    theirs.send(struct.pack("=IB3x8s", 0x2000_0040, 8, b""))
    bus._readable()
    assert not bus.send(Frame(0x185, b"\2"))
    assert theirs.recv(99) == pack(Frame(0x185, b"\1"))
    with pytest.raises(BlockingIOError):
        theirs.recv(99, socket.MSG_DONTWAIT)


async def test_machine_without_can_is_refused_with_advice() -> None:
    with contextlib.suppress(OSError):
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
        pytest.skip("this kernel has CAN")
    with pytest.raises(BusError, match=r"^can0: .*load the kernel modules can and can_raw"):
        await SocketCanBus("can0", Recorder()).open()


@pytest.mark.parametrize(
    "number, words",
    [(errno.EPERM, "may not use SocketCAN"), (errno.EAFNOSUPPORT, "load the kernel modules")],
)
def test_why_there_is_no_can_socket(number: int, words: str) -> None:
    assert words in no_socketcan(OSError(number, os.strerror(number)))
