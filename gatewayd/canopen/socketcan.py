"""SocketCAN on the loop: one raw socket, kernel filters, reads in batches, sends that never wait.

The interface is looked at ten times a second, so a controller that comes back is found without anybody's help, and
one that was unplugged and plugged in again is opened by its name. Nothing here configures an interface.
"""

from __future__ import annotations

import asyncio
import errno
import socket
import struct
from collections.abc import Iterable

from gatewayd.canopen.bus import DRAIN, BusError, BusHandler
from gatewayd.canopen.errors import ErrorFrame, decode
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.interface import ControllerState, Interface, InterfaceReader
from gatewayd.canopen.supervised import SupervisedBus
from gatewayd.canopen.supervision import FAILURES, LOOK, BusSignal
from gatewayd.loop import clock

CATCH_UP_FRAMES = 16_384
"""Most frames that are read in one go after the process stood still: more than any receive buffer holds."""
RECEIVE_BUFFER = 2 << 20
"""Bytes asked for: some 2,700 frames, 0.3 s of a saturated bus of 1 Mbit/s. net.core.rmem_max may allow less."""
SEND_BUFFER = 2304
"""Bytes asked for: the minimum that the kernel gives, room for some six frames. What is in there goes out late when a
bus that stood still recovers, so that it must not be much; the interface's own queue takes more (txqueuelen, by
default ten), so that the kernel reports when there is room."""

_FRAME = struct.Struct("=IB3x8s")
"""struct can_frame: identifier with flags, length, eight bytes."""
_FILTER = struct.Struct("=II")
_MEMORY_INFO = struct.Struct("=9I")
"""SO_MEMINFO: among others the bytes that wait to be sent and the count of dropped frames (linux/sock_diag.h)."""
_EXTENDED, _REMOTE, _ERROR = 0x8000_0000, 0x4000_0000, 0x2000_0000
_BASIC = 0x7FF
_EXACT = _BASIC | _EXTENDED | _REMOTE
"""Mask of a filter for one identifier and data frames; the kernel finds the socket for it by a table."""
_MAX_FILTERS = 512
_MEMINFO_SENDING, _MEMINFO_DROPS = 2, 8
_SO_MEMINFO, _CAN_RAW_ERR_FILTER = 55, 2
_EVERY_ERROR = 0x1FFF_FFFF
_NO_ROOM = (errno.ENOBUFS, errno.EAGAIN)

_unpack = _FRAME.unpack
_new_frame = tuple.__new__
"""A Frame without the detour over its keyword arguments: a third of the cost of a received frame."""

_CONTROLLER = {
    ControllerState.ACTIVE: BusSignal.ACTIVE,
    ControllerState.WARNING: BusSignal.WARNING,
    ControllerState.PASSIVE: BusSignal.PASSIVE,
    ControllerState.BUS_OFF: BusSignal.OFF,
    ControllerState.STOPPED: BusSignal.DOWN,
    ControllerState.SLEEPING: BusSignal.DOWN,
}


def pack(frame: Frame) -> bytes:
    """A frame as struct can_frame."""
    can_id, data, remote, length = frame
    return _FRAME.pack(can_id | _REMOTE, length, b"") if remote else _FRAME.pack(can_id, len(data), data)


def filters(can_ids: Iterable[int], remote_ids: Iterable[int]) -> bytes:
    """CAN_RAW_FILTER: exactly these; with more of them than the kernel takes, every 11-bit identifier."""
    wanted = [_FILTER.pack(can_id, _EXACT) for can_id in sorted(set(can_ids))]
    wanted += [_FILTER.pack(can_id | _REMOTE, _EXACT) for can_id in sorted(set(remote_ids))]
    if len(wanted) > _MAX_FILTERS:
        return _FILTER.pack(0, _EXTENDED)
    return b"".join(wanted)


def seen(name: str, interface: Interface | None) -> tuple[BusSignal, str]:
    """What a look at the interface means, as a signal and in words."""
    if interface is None:
        return BusSignal.GONE, (
            f"there is no interface {name}; plug in its adapter, or correct `channel` "
            "(`ip link show type can` lists them): it is opened as soon as it is there"
        )
    if not interface.up:
        return BusSignal.DOWN, f"{name} is down; `ip link set {name} up` brings it up"
    if not interface.carrier:
        restart = f"it stays off until {name} is set down and up again (restart-ms is not set)"
        if interface.restart_ms:
            restart = f"the kernel restarts it after {interface.restart_ms} ms"
        return BusSignal.OFF, f"{name} is off the bus; {restart}"
    signal = BusSignal.UP if interface.controller is None else _CONTROLLER[interface.controller]
    if interface.rx_errors is None:
        return signal, f"{name} is up"
    return (
        signal,
        f"{name} is up (transmit errors: {interface.tx_errors}, receive errors: {interface.rx_errors})",
    )


class SocketCanBus(SupervisedBus):
    """One interface of the kernel, by name."""

    def __init__(self, channel: str, handler: BusHandler) -> None:
        super().__init__(handler)
        self.interface: Interface | None = None
        """The last look at it."""
        self._channel = channel
        self._filters = b""
        self._socket: socket.socket | None = None
        self._index = 0
        self._lost = 0
        self._reader: InterfaceReader | None = None

    @property
    def bitrate(self) -> int | None:
        """As the interface is configured; None for one that has no bit rate (vcan)."""
        return self.interface.bitrate if self.interface is not None else None

    async def open(self) -> None:
        """Start. BusError if the kernel has no CAN, the sandbox forbids it, or the name is no CAN interface's."""
        self._loop = asyncio.get_running_loop()
        try:
            _probe()
            self._reader = InterfaceReader()
        except BusError as error:
            raise BusError(f"{self._channel}: {error}") from error
        try:
            found = self._reader.read(self._channel)
        except OSError as error:
            self.close()
            raise BusError(f"{self._channel}: {error.strerror}") from error
        if found is not None and not found.is_can:
            self.close()
            raise BusError(f"{self._channel} is not a CAN interface; `ip link show type can` lists them")
        self._look()

    def close(self) -> None:
        """Stop, and ask the kernel no more."""
        super().close()
        if self._reader is not None:
            self._reader.close()
            self._reader = None

    def set_filters(self, can_ids: Iterable[int], remote_ids: Iterable[int] = ()) -> None:
        """Filter in the kernel; frames that it has let through already still come."""
        self._filters = filters(can_ids, remote_ids)
        if self._socket is not None:
            self._socket.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, self._filters)

    def _give(self, frame: Frame) -> bool:
        if self._socket is None:
            return False
        try:
            self._socket.send(pack(frame))
        except OSError as error:
            if error.errno in _NO_ROOM:
                # The end of a full queue of the interface (ENOBUFS) is not reported by the kernel.
                self._wait_for_room(self._socket.fileno() if error.errno == errno.EAGAIN else -1)
            else:
                self._failed(error)
            return False
        return True

    def _pending(self) -> int:
        return _memory(self._socket)[_MEMINFO_SENDING] if self._socket is not None else 0

    # Receiving

    def catch_up(self) -> bool:
        """Hand over all that wait, which are never too many."""
        self._read(clock.now(), CATCH_UP_FRAMES)
        return True

    def _readable(self) -> None:
        self._read(clock.judged_now(), DRAIN)

    def _read(self, now: float, limit: int) -> None:
        """Hand over at most so many frames that wait."""
        if self._socket is None:
            return
        frames: list[Frame] = []
        errors: list[ErrorFrame] = []
        failure: OSError | None = None
        receive, append = self._socket.recv, frames.append
        try:
            for _ in range(limit):
                parts = can_id, length, data = _unpack(receive(_FRAME.size))
                if can_id <= _BASIC:
                    append(_new_frame(Frame, (can_id, data[:length], False, 0)))
                else:
                    _take_other(parts, frames, errors)
        except BlockingIOError:
            pass
        except OSError as error:
            failure = error
        self._hand_over(frames, errors, now)
        if failure is not None:
            self._failed(failure)

    def _count_lost(self, raw: socket.socket, now: float) -> None:
        """Ask the kernel for its count of frames that found no room, the one that SO_RXQ_OVFL attaches to frames.

        Asked for with each look it costs nothing per frame, and counts the last frames too, which none follows.
        """
        total = _memory(raw)[_MEMINFO_DROPS]
        lost = (total - self._lost) & 0xFFFF_FFFF
        if lost:
            self._lost = total
            self._handler.on_lost(lost, now)

    # State

    def _failed(self, error: OSError) -> None:
        """A send or receive failed: believe it, and look at once, for the reason may be gone already."""
        signal = FAILURES.get(error.errno or 0, BusSignal.GONE)
        self._feed(signal, clock.now(), f"{self._channel}: {error.strerror}")
        if signal is not BusSignal.DOWN:
            self._release()

    def _look(self) -> None:
        """Look at the interface, open it if it is another one, and come again."""
        assert self._reader is not None
        now = clock.now()
        self._looking = self._loop.call_later(LOOK, self._look)
        try:
            self.interface = found = self._reader.read(self._channel)
        except OSError:
            return  # out of memory for a moment: nothing is known, so nothing changes
        if found is None or found.index != self._index:
            self._release()
        if found is not None:
            if self._socket is None and not self._acquire(found, now):
                return
            assert self._socket is not None
            self._count_lost(self._socket, now)
        signal, words = seen(self._channel, found)
        self._feed(signal, now, words)

    # The socket

    def _acquire(self, found: Interface, now: float) -> bool:
        """Open the socket; False if it has to be tried again later."""
        if not self._supervisor.may_open(now):
            return False
        try:
            self._socket = self._make_socket()
        except OSError as error:
            self._supervisor.failed(now)
            self._feed(BusSignal.GONE, now, f"{self._channel} cannot be opened: {error.strerror}")
            return False
        self._supervisor.opened()
        self._index = found.index
        self._lost = 0
        self._loop.add_reader(self._socket, self._readable)
        return True

    def _make_socket(self) -> socket.socket:
        raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        try:
            raw.setblocking(False)
            raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, self._filters)
            raw.setsockopt(socket.SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, _EVERY_ERROR)
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
            raw.bind((self._channel,))
        except OSError:
            raw.close()
            raise
        return raw

    def _release(self) -> None:
        if self._socket is None:
            return
        self._forget_waiting()
        self._loop.remove_reader(self._socket)
        self._socket.close()
        self._socket = None
        self._index = 0


def _memory(raw: socket.socket) -> tuple[int, ...]:
    return _MEMORY_INFO.unpack(raw.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMORY_INFO.size))


def _take_other(parts: tuple[int, int, bytes], frames: list[Frame], errors: list[ErrorFrame]) -> None:
    """What is no data frame of ours; frames with 29-bit identifiers are nobody's."""
    can_id, length, data = parts
    if can_id & _ERROR:
        errors.append(decode(can_id, data[:length]))
    elif not can_id & _EXTENDED:
        frames.append(Frame(can_id & _BASIC, b"", remote=True, length=length))


def no_socketcan(error: OSError) -> str:
    """Why the kernel gives no CAN socket, and what to do."""
    if error.errno in (errno.EPERM, errno.EACCES):
        return f"this process may not use SocketCAN: {error.strerror}; run it as the service does, or lift the sandbox"
    return (
        f"this machine offers no SocketCAN: {error.strerror}; load the kernel modules can and can_raw, "
        "and allow AF_CAN (in a systemd unit: RestrictAddressFamilies=)"
    )


def _probe() -> None:
    try:
        socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW).close()
    except OSError as error:
        raise BusError(no_socketcan(error)) from error
