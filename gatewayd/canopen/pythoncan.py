"""Every other interface of python-can on the loop: virtual, slcan, udp_multicast, vendors' adapters.

Opening may take seconds, and is done in a daemon thread; apart from that there is no thread of ours. Where the
interface has a file descriptor the loop watches it; where it has none it is asked for frames every millisecond while
there is traffic, more seldom when there is none. What python-can's configuration file says (`~/.canrc`,
`/etc/can.conf`) holds for what the mapping does not say, so a vendor's own options have a place.
"""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import logging
import select
import socket
import struct
import termios
from collections.abc import Iterable
from functools import partial
from typing import Any

import can

from gatewayd.canopen.bus import DRAIN, BusError, BusHandler
from gatewayd.canopen.cob_ids import BASIC_FRAME
from gatewayd.canopen.errors import ErrorFrame, decode
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.supervised import SupervisedBus
from gatewayd.canopen.supervision import LOOK, BusSignal
from gatewayd.loop import clock
from gatewayd.loop.threads import in_daemon_thread

ASK = 0.001
"""Seconds between two questions to an interface without a file descriptor, while frames come."""
ASK_LIMIT = 0.008
"""The same after a while without frames."""
CATCH_UP = 0.25
"""Longest time for reading in one go after the process stood still."""
SLICE = 0.005
"""Longest time for reading before the loop has its turn: an adapter may hand over its frames byte by byte."""

_OPTIONS: dict[str, dict[str, Any]] = {
    # It would sleep two seconds for boards that restart when they are opened, and a millisecond for every read.
    "slcan": {"sleep_after_open": 0, "timeout": 0},
}
_SIOCOUTQNSD = 0x894B
"""linux/sockios.h: bytes of a connection that were not sent yet."""
_INT = struct.Struct("i")
_LIKE_SOCKETCAN = {"socketcan", "socketcand", "udp_multicast", "virtual"}
"""Interfaces whose error frames have the layout of SocketCAN."""

logging.getLogger("can").setLevel(logging.CRITICAL)


class PythonCanBus(SupervisedBus):
    """One channel of one interface. What cannot be opened is tried again, at intervals that grow to two seconds."""

    def __init__(self, interface: str, channel: str, bitrate: int, handler: BusHandler) -> None:
        super().__init__(handler)
        self._interface = interface
        self._channel = channel
        self._bitrate = bitrate
        self._wanted: frozenset[int] = frozenset()
        self._wanted_remote: frozenset[int] = frozenset()
        self._bus: can.BusABC | None = None
        self._descriptor = -1
        self._readiness, self._room = select.poll(), select.poll()
        self._ask = ASK
        self._reading: asyncio.Handle | None = None
        self._opening: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Start. BusError if python-can has no such interface, lacks a package for it, or refuses the settings."""
        self._loop = asyncio.get_running_loop()
        await self._acquire()
        self._looking = self._loop.call_later(LOOK, self._look)

    def close(self) -> None:
        """Stop, and give up an attempt to open it."""
        if self._opening is not None:
            self._opening.cancel()
            self._opening = None
        super().close()

    def set_filters(self, can_ids: Iterable[int], remote_ids: Iterable[int] = ()) -> None:
        """Filter in the adapter where it can, and here in any case."""
        self._wanted = frozenset(can_ids)
        self._wanted_remote = frozenset(remote_ids)
        if self._bus is not None:
            self._filter_in_adapter(self._bus)

    def _give(self, frame: Frame) -> bool:
        if self._bus is None:
            return False
        if self._descriptor >= 0 and not self._room.poll(0):
            self._wait_for_room(self._descriptor)
            return False
        message = can.Message(
            arbitration_id=frame.can_id,
            is_extended_id=False,
            is_remote_frame=frame.remote,
            dlc=frame.length if frame.remote else len(frame.data),
            data=None if frame.remote else frame.data,
            check=False,
        )
        try:
            self._bus.send(message, timeout=0)
        except (can.CanError, OSError, ValueError) as error:
            if isinstance(error, TimeoutError | BlockingIOError):
                self._wait_for_room(self._descriptor)
            else:
                self._lose(error)
            return False
        return True

    def _pending(self) -> int:
        """Bytes that the operating system has not passed on: of a connection those not sent yet, of a serial port all.

        An adapter's own buffers are not known.
        """
        if self._descriptor < 0:
            return 0
        for request in (_SIOCOUTQNSD, termios.TIOCOUTQ):
            with contextlib.suppress(OSError):
                return int(_INT.unpack(fcntl.ioctl(self._descriptor, request, bytes(_INT.size)))[0])
        return 0

    # Receiving

    def catch_up(self) -> bool:
        """Hand over what waits, for at most `CATCH_UP` seconds."""
        end = clock.now() + CATCH_UP
        while self._bus is not None and not self._read(self._bus):
            if clock.now() >= end:
                return False
        return True

    def _readable(self) -> None:
        """The descriptor has something."""
        clock.judged_now()
        if self._bus is not None and not self._read(self._bus) and self._reading is None:
            # What the interface has read already, no descriptor announces.
            self._reading = self._loop.call_soon(self._read_on)

    def _read_on(self) -> None:
        self._reading = None
        self._readable()

    def _look_for_frames(self) -> None:
        """There is no descriptor: ask, the more often the more comes."""
        clock.judged_now()
        if self._bus is None:
            return
        self._ask = min(2 * self._ask, ASK_LIMIT)
        exhausted = self._read(self._bus)
        self._reading = self._loop.call_later(self._ask if exhausted else 0, self._look_for_frames)

    def _read(self, bus: can.BusABC) -> bool:
        """Read for a while; whether there is no more."""
        now = clock.now()
        frames: list[Frame] = []
        errors: list[ErrorFrame] = []
        failure: Exception | None = None
        exhausted = False
        try:
            while len(frames) < DRAIN and clock.now() - now < SLICE:
                message = bus.recv(0)
                if message is not None:
                    self._take(message, frames, errors)
                elif self._descriptor < 0 or not self._readiness.poll(0):
                    exhausted = True
                    break
        except Exception as error:  # noqa: BLE001 - drivers let through whatever the nonsense of an adapter made of them
            failure = error
        if frames:
            self._ask = ASK
        self._hand_over(frames, errors, now)
        if failure is not None:
            self._lose(failure)
        return exhausted or failure is not None

    def _take(self, message: can.Message, frames: list[Frame], errors: list[ErrorFrame]) -> None:
        can_id = message.arbitration_id
        if message.is_error_frame:
            known = self._interface in _LIKE_SOCKETCAN
            errors.append(decode(can_id, bytes(message.data)) if known else decode(0, b""))
        elif message.is_extended_id or message.is_fd or can_id > BASIC_FRAME:
            return
        elif message.is_remote_frame:
            if can_id in self._wanted_remote:
                frames.append(Frame(can_id, b"", remote=True, length=message.dlc))
        elif can_id in self._wanted:
            frames.append(Frame(can_id, bytes(message.data)))

    # State

    def _look(self) -> None:
        """Open what is closed, ask an adapter that knows its state for it, and come again."""
        now = clock.now()
        self._looking = self._loop.call_later(LOOK, self._look)
        if self._bus is None:
            if self._opening is None and self._supervisor.may_open(now):
                self._opening = self._loop.create_task(self._open_again())
        elif type(self._bus).state is not can.BusABC.state:
            try:
                off = self._bus.state is can.BusState.ERROR
            except (can.CanError, OSError) as error:
                self._lose(error)
                return
            signal, words = (BusSignal.OFF, "off the bus") if off else (BusSignal.UP, "up")
            self._feed(signal, now, f"{self._name} is {words}")

    @property
    def _name(self) -> str:
        return f"{self._interface} {self._channel}"

    def _lose(self, error: Exception) -> None:
        """The interface fails: close it, and open it again when it can be."""
        now = clock.now()
        self._release(broken=True)
        self._supervisor.failed(now)
        self._feed(BusSignal.GONE, now, f"{self._name}: {error}")

    # The interface

    async def _open_again(self) -> None:
        try:
            with contextlib.suppress(BusError):  # it could be used before, so that will pass too
                await self._acquire()
        finally:
            self._opening = None

    async def _acquire(self) -> None:
        self._supervisor.failed(clock.now())  # until it is known better
        try:
            bus = await in_daemon_thread(self._make, f"open {self._name}", can.BusABC.shutdown)
        except (can.CanInitializationError, can.CanOperationError, OSError) as error:
            self._feed(BusSignal.GONE, clock.now(), f"{self._name} cannot be opened: {error}")
            return
        self._bus = bus
        self._supervisor.opened()
        self._filter_in_adapter(bus)
        with contextlib.suppress(NotImplementedError, can.CanError, OSError):
            self._descriptor = bus.fileno()
        self._readiness, self._room = select.poll(), select.poll()
        if self._descriptor >= 0:
            self._readiness.register(self._descriptor, select.POLLIN)
            self._room.register(self._descriptor, select.POLLOUT)
            self._loop.add_reader(self._descriptor, self._readable)
        self._ask = ASK
        read = self._read_on if self._descriptor >= 0 else self._look_for_frames
        self._reading = self._loop.call_soon(read)
        self._feed(BusSignal.UP, clock.now(), f"{self._name} is open")

    def _make(self) -> can.BusABC:
        try:
            bus = can.Bus(
                channel=self._channel,
                interface=self._interface,
                bitrate=self._bitrate,
                **_OPTIONS.get(self._interface, {}),
            )
        except (can.CanInterfaceNotImplementedError, ImportError) as error:
            raise BusError(
                f"python-can cannot use the interface {self._interface}: {error}; "
                "install what it needs, or name another one (`python3 -m can.viewer --help` lists them)"
            ) from error
        except (ValueError, TypeError, can.CanInitializationError) as error:
            if isinstance(error, can.CanError) and not isinstance(error.__cause__, ValueError):
                raise
            raise BusError(
                f"{self._interface} refuses channel {self._channel} at {self._bitrate} bit/s: {error}"
            ) from error
        port = _serial_port(bus)
        if port is not None:
            port.flush = lambda: None  # it would wait until the wire has carried the frame
            # A port at the other end of a TCP connection (`socket://`).
            connection = getattr(port, "_socket", None)
            if isinstance(connection, socket.socket):
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                port.close = partial(_hang_up, port, connection)
        return bus

    def _filter_in_adapter(self, bus: can.BusABC) -> None:
        if type(bus)._apply_filters is can.BusABC._apply_filters:  # noqa: SLF001 - the only way to know if it would be done in Python
            return
        both = self._wanted | self._wanted_remote
        with contextlib.suppress(can.CanError, OSError, NotImplementedError):
            bus.set_filters(
                [{"can_id": can_id, "can_mask": BASIC_FRAME, "extended": False} for can_id in both]
            )

    def _release(self, *, broken: bool = False) -> None:
        bus, self._bus = self._bus, None
        if bus is None:
            return
        self._forget_waiting()
        if self._reading is not None:
            self._reading.cancel()
            self._reading = None
        if self._descriptor >= 0:
            self._loop.remove_reader(self._descriptor)
        port = _serial_port(bus)
        if port is not None and (broken or not self._room.poll(0)):
            # Saying goodbye to a device that takes nothing would wait for ever.
            with contextlib.suppress(Exception):
                port.close()
        self._descriptor = -1
        with contextlib.suppress(Exception):  # a driver may raise anything about a device that is gone
            bus.shutdown()


def _serial_port(bus: can.BusABC) -> Any:
    """The serial port below slcan; None for every other interface."""
    return getattr(bus, "serialPortOrig", None)


def _hang_up(port: Any, connection: socket.socket) -> None:
    """Close the connection below the port. The port's own `close` sleeps for 0.3 s then, and the loop with it."""
    connection.close()
    port.is_open = False
