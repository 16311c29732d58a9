"""The way from the controller to one client: as fast as the socket, or late by as much as the faults say."""

from __future__ import annotations

import asyncio
from collections import deque

from gatewayd.simulator.clock import EARLY, ClockTimer, SimulatorClock
from gatewayd.simulator.faults import Faults


class OutgoingLine:
    """Hands bytes to a transport in their order; `faults.delay` counts when they are written, by the clock."""

    def __init__(self, transport: asyncio.Transport, faults: Faults, clock: SimulatorClock) -> None:
        self._transport = transport
        self._faults = faults
        self._clock = clock
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._timer: ClockTimer | None = None

    def write(self, data: bytes) -> None:
        """Send `data` now, or when its delay is over; never before what was written earlier."""
        if not self._waiting and not self._faults.delay:
            self._transport.write(data)
            return
        now = self._clock.now
        last = self._waiting[-1][0] if self._waiting else now
        self._waiting.append((max(now + self._faults.delay, last), data))
        if self._timer is None:
            self._schedule()

    def close(self) -> None:
        """Drop what has not left yet."""
        self._waiting.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _schedule(self) -> None:
        self._timer = self._clock.call_at(self._waiting[0][0], self._send)

    def _send(self) -> None:
        self._timer = None
        now = self._clock.now
        while self._waiting and self._waiting[0][0] <= now + EARLY:
            data = self._waiting.popleft()[1]
            if not self._transport.is_closing():
                self._transport.write(data)
        if self._waiting:
            self._schedule()
