"""A CAN bus as the node sees it, and what all drivers do alike: keep its state, report, wait for room."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Iterable

from gatewayd.canopen.bus import BusHandler, BusState
from gatewayd.canopen.errors import ErrorFrame
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.supervision import BusSignal, Supervisor, signal_of_error
from gatewayd.loop import clock

ROOM_RETRY = 0.001
"""Seconds to wait for room that nothing announces."""
LAG = 0.005
"""Seconds after which a frame that was taken should have gone out."""
_LAG_BITS = 1350
"""Bits that may go before it: ten frames. On slow buses they take longer than `LAG`."""
_PASSIVE = BusState.PASSIVE
"""A name of its own, because it is looked up for each frame that is sent."""


class SupervisedBus(ABC):
    """A driver, used in the loop: reopens by itself whatever comes back, and never configures an interface."""

    _loop: asyncio.AbstractEventLoop
    """Set when the driver is opened."""

    def __init__(self, handler: BusHandler) -> None:
        self._handler = handler
        self._supervisor = Supervisor()
        self.reason = ""
        """Why the bus is as it is, in words, as of the last look."""
        self._looking: asyncio.TimerHandle | None = None
        """The next look at the interface."""
        self._full = False
        """A frame was refused for want of room, and `on_writable` was not called since."""
        self._writable = -1
        """The descriptor that is watched for room; -1 where there is none, or nothing is waited for."""
        self._retrying: asyncio.TimerHandle | None = None
        self._handed_over = 0.0
        """When the last frame was taken."""

    @property
    def state(self) -> BusState:
        """As far as the interface shows it; ABSENT until it is opened."""
        return self._supervisor.state

    @property
    def bitrate(self) -> int | None:
        """Bit/s that the controller is really set to, where that can be known."""
        return None

    @abstractmethod
    async def open(self) -> None:
        """Start. An interface that is not there is waited for; BusError if waiting cannot help."""

    def close(self) -> None:
        """Stop, without a last `on_state`."""
        if self._looking is not None:
            self._looking.cancel()
            self._looking = None
        self._release()

    @abstractmethod
    def set_filters(self, can_ids: Iterable[int], remote_ids: Iterable[int] = ()) -> None:
        """Receive data frames of `can_ids` and remote frames of `remote_ids`, and nothing else."""

    @abstractmethod
    def catch_up(self) -> bool:
        """Hand over all received frames that wait, instead of leaving the loop its turns in between.

        False: they were so many that it has to be called again.
        """

    def send(self, frame: Frame) -> bool:
        """Hand over a frame, without waiting. False: not now; `on_writable` or `on_state` is called when it can be."""
        if self._full or self._supervisor.state < _PASSIVE or not self._give(frame):
            return False
        self._handed_over = clock.now()
        return True

    def lags(self, bit_rate: int | None) -> bool:
        """Whether a frame that is sent now would be late, as far as that can be known: older ones wait for the bus."""
        lag = max(LAG, _LAG_BITS / bit_rate) if bit_rate else LAG
        return clock.now() - self._handed_over > lag and self._pending() > 0

    @abstractmethod
    def _give(self, frame: Frame) -> bool:
        """Give a frame to the open interface. False: there is no room, which is waited for now, or it has failed."""

    @abstractmethod
    def _pending(self) -> int:
        """Bytes that were taken and have not gone out; 0 where nobody knows."""

    @abstractmethod
    def _release(self) -> None:
        """Close the interface, if it is open."""

    def _feed(self, signal: BusSignal, now: float, reason: str) -> None:
        """Judge a signal, and report the state if it is another one now."""
        self.reason = reason
        if not self._supervisor.feed(signal):
            return
        state = self._supervisor.state
        if not state.carries:
            self._forget_waiting()
        self._handler.on_state(state, reason, now)

    def _hand_over(self, frames: list[Frame], errors: list[ErrorFrame], now: float) -> None:
        """Give the handler what was read: data frames, then each error frame and the state that follows from it.

        If the process was stopped while it read, the frames have waited since the time was judged last: what has to
        know of the gap is called before.
        """
        if frames:
            if clock.overdue():
                now = clock.judged_now()
            self._handler.on_frames(frames, now)
        for error in errors:
            self._handler.on_error(error, now)
            signal = signal_of_error(error)
            if signal is not None:
                self._feed(signal, now, f"the controller reports: {error}")

    def _wait_for_room(self, descriptor: int) -> None:
        """Report when `descriptor` can be written; with -1, after `ROOM_RETRY`."""
        self._full = True
        self._writable = descriptor
        if descriptor >= 0:
            self._loop.add_writer(descriptor, self._report_room)
        else:
            self._retrying = self._loop.call_later(ROOM_RETRY, self._report_room)

    def _report_room(self) -> None:
        self._forget_waiting()
        self._handler.on_writable(clock.now())

    def _forget_waiting(self) -> None:
        """Wait no longer. To be called before the descriptor is closed."""
        self._full = False
        if self._retrying is not None:
            self._retrying.cancel()
            self._retrying = None
        if self._writable >= 0:
            self._loop.remove_writer(self._writable)
            self._writable = -1
