"""What every driver does alike: keep the state of its bus, count, call its handler, and wait for room to send."""

from __future__ import annotations

import asyncio

from gatewayd.canopen.bus import BusCounters, BusHandler, BusState
from gatewayd.canopen.errors import ErrorFrame
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.supervision import BusSignal, Supervisor, event_of_error
from gatewayd.loop import clock

__all__ = ["LAG", "ROOM_RETRY", "SupervisedBus"]

ROOM_RETRY = 0.001
"""Seconds to wait for room that nothing announces."""
LAG = 0.005
"""Seconds after which a frame that was taken should have gone out."""
_LAG_BITS = 1350
"""Bits that may go before it: ten frames. On slow buses they take longer than `LAG`."""


class SupervisedBus:
    """The part of a driver that knows no interface. It is used in the loop."""

    def __init__(self, handler: BusHandler) -> None:
        self.counters = BusCounters()
        self._handler = handler
        self._supervisor = Supervisor()
        self._loop: asyncio.AbstractEventLoop | None = None
        """Set when the driver is opened."""
        self._full = False
        """A frame was refused for want of room, and `on_writable` was not told since."""
        self._writable = -1
        """The descriptor that will tell of room; -1 where there is none, or nothing is waited for."""
        self._retrying: asyncio.TimerHandle | None = None
        self._handed_over = 0.0
        """When the last frame was taken."""

    @property
    def state(self) -> BusState:
        """As far as the interface tells it."""
        return self._supervisor.state

    def lags(self, bit_rate: int | None) -> bool:
        """Whether frames that were taken some time ago have still not gone out, as far as that can be known."""
        lag = max(LAG, _LAG_BITS / bit_rate) if bit_rate else LAG
        return clock.now() - self._handed_over > lag and self._pending() > 0

    def _pending(self) -> int:
        """Bytes that were taken and have not gone out; 0 where nobody knows."""
        return 0

    def _feed(self, event: BusSignal, now: float, reason: str) -> None:
        """Judge an event, and tell of the state if it is another one now."""
        if not self._supervisor.feed(event, now):
            return
        state = self._supervisor.state
        if state is BusState.BUS_OFF:
            self.counters.bus_off += 1
        if not state.carries:
            self._forget_waiting()
        self._handler.on_state(state, reason, now)

    def _hand_over(self, frames: list[Frame], errors: list[ErrorFrame], now: float) -> None:
        """Give the handler what was read, data frames first.

        If the process was stopped while it read, the frames have waited since the time was judged last: whoever has to
        know of the gap is called before.
        """
        if frames:
            if clock.overdue():
                now = clock.judged_now()
            self.counters.received += len(frames)
            self._handler.on_frames(frames, now)
        for report in errors:
            self._take_error(report, now)

    def _take_error(self, report: ErrorFrame, now: float) -> None:
        """Report an error frame, then the state that follows from it."""
        self.counters.errors += 1
        if report.tx_errors is not None and report.rx_errors is not None:
            self.counters.tx_errors, self.counters.rx_errors = report.tx_errors, report.rx_errors
        self._handler.on_error(report, now)
        event = event_of_error(report)
        if event is not None:
            self._feed(event, now, f"the controller reports: {report}")

    def _wait_for_room(self, descriptor: int) -> None:
        """Tell when `descriptor` can be written; with -1, after `ROOM_RETRY`."""
        assert self._loop is not None
        self._full = True
        self._writable = descriptor
        if descriptor >= 0:
            self._loop.add_writer(descriptor, self._tell_room)
        else:
            self._retrying = self._loop.call_later(ROOM_RETRY, self._tell_room)

    def _tell_room(self) -> None:
        self._forget_waiting()
        self._handler.on_writable(clock.now())

    def _forget_waiting(self) -> None:
        """Wait no longer. To be called before the descriptor is closed."""
        self._full = False
        if self._retrying is not None:
            self._retrying.cancel()
            self._retrying = None
        if self._writable >= 0 and self._loop is not None:
            self._loop.remove_writer(self._writable)
            self._writable = -1
