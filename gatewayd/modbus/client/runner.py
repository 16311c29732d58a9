"""A line at work on the event loop: its connection, its timers, and what comes in.

`tcp` and `serial` open what it speaks on. Nothing here waits for a unit: the loop is free while one is slow.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from gatewayd.loop import clock
from gatewayd.loop.progress import STEP, wait_with_progress
from gatewayd.modbus.client.backoff import Backoff
from gatewayd.modbus.client.conversation import Conversation
from gatewayd.modbus.client.line import ConnectionUse, Line
from gatewayd.modbus.client.polling import NEVER
from gatewayd.modbus.client.requests import ModbusRequest
from gatewayd.modbus.client.station import Station

_SHORTEST_SLEEP = 0.000_2
_STOPPED = "the line was stopped"


class LineError(Exception):
    """A connection could not be opened; the message says what and, where it is known, what to do."""


class Channel(Protocol):
    """An open connection. Its bytes go to `LineRunner.received`, its end to `LineRunner.ended`."""

    def send(self, data: bytes) -> None:
        """Send a frame; never waits."""

    def close(self) -> None:
        """Close it at once."""


class LineRunner(ABC):
    """Runs one line, in one task, until it is cancelled."""

    def __init__(self, line: Line, report: Callable[[str], object] = lambda _reason: None) -> None:
        """`report` is called with why there is no connection, once for each reason, and with "" when there is one.

        A connection that was of use and is there again at once is no news.
        """
        self.line = line
        self.progress = 0
        """Grows at least every quarter of a second while the line runs, for a watchdog."""
        self._report = report
        self._reported = ""
        self._channel: Channel | None = None
        self._ended_early = ""
        self._changed = asyncio.Event()
        self._timer: asyncio.TimerHandle | None = None
        self._timer_at = NEVER
        self._is_busy = False
        self._loop: asyncio.AbstractEventLoop | None = None
        for station in line.stations:
            station.wake = self._wake

    @abstractmethod
    async def open(self) -> Channel:
        """A new connection. Raises LineError if there is none."""

    @abstractmethod
    def make_conversation(self) -> Conversation:
        """What is kept of a new connection."""

    def add(self, station: Station) -> None:
        """Another unit, at any time."""
        self.line.add(station)
        station.wake = self._wake
        self._wake()

    def remove(self, station: Station) -> None:
        """The unit goes, at any time; it counts as lost."""
        self.line.remove(station, clock.now())
        self._wake()

    def broadcast(self, request: ModbusRequest) -> bool:
        """See `Line.broadcast`."""
        is_taken = self.line.broadcast(request)
        self._wake()
        return is_taken

    async def run(self) -> None:
        """Keep the line at work. Ends by cancellation only; the connection is closed and all units are lost then."""
        self._loop = asyncio.get_running_loop()
        backoff = Backoff(self.line.settings.max_backoff)
        try:
            while True:
                pause = self._connect_at(backoff) - clock.now()
                if pause > 0:
                    await self._wait(min(pause, STEP))
                else:
                    await self._connect(backoff)
        finally:
            self._close(_STOPPED)
            self._set_timer(NEVER, 0.0)
            self._loop = None
            self.line.stop(_STOPPED, clock.now())

    def received(self, data: bytes) -> None:
        """Bytes have come in."""
        now = clock.judged_now()
        if self._channel is None:
            return
        self._is_busy = True
        try:
            reason = self.line.received(data, now)
        finally:
            self._is_busy = False
        if reason:
            self._close(reason)
        else:
            self._turn(now)

    def ended(self, reason: str) -> None:
        """The connection was closed by the other side, or broke."""
        if self._channel is None:
            # A device whose places are all taken closes a connection before `open` has returned it.
            self._ended_early = reason
        self._close(reason)

    def _connect_at(self, backoff: Backoff) -> float:
        """When to open the connection."""
        if not self.line.stations:
            return NEVER
        if self.line.settings.use is ConnectionUse.KEPT:
            return backoff.until
        return max(backoff.until, self.line.due_at())

    async def _connect(self, backoff: Backoff) -> None:
        """Open the connection and stay until it is closed."""
        limit = self.line.settings.connect_timeout
        self._ended_early = ""
        try:
            channel = await wait_with_progress(self._open_in_time(limit), self._count_progress, limit)
        except (LineError, TimeoutError) as error:
            self._say_unconnected(backoff, str(error) or f"no connection within {limit:g} s")
            return
        if self._ended_early:
            channel.close()
            self._say_unconnected(backoff, self._ended_early)
            return
        self._channel = channel
        now = clock.now()
        self.line.connected(self.make_conversation(), now)
        self._turn(now)
        while self.line.is_connected:
            await self._wait(STEP)
        if self.line.was_of_use:
            backoff.worked()
        else:
            backoff.failed(clock.now())

    def _say_unconnected(self, backoff: Backoff, reason: str) -> None:
        backoff.failed(clock.now())
        self._say(reason)
        self.line.disconnected(reason, clock.now())
        self._turn(clock.now())

    async def _open_in_time(self, limit: float) -> Channel:
        async with asyncio.timeout(limit):
            return await self.open()

    async def _wait(self, limit: float) -> None:
        """Until something changes for who opens connections, at most `limit` seconds."""
        self._changed.clear()
        with suppress(TimeoutError):
            async with asyncio.timeout(limit):
                await self._changed.wait()
        self._count_progress()
        if self._timer is None:
            self._turn(clock.now())

    def _count_progress(self) -> None:
        self.progress += 1

    def _wake(self) -> None:
        """Somebody has something to send. In the middle of a turn its end sees to that."""
        if self._loop is not None and not self._is_busy:
            self._changed.set()
            self._turn(clock.now())

    def _turn(self, now: float) -> None:
        """Judge what is overdue, and send what is due."""
        self._is_busy = True
        try:
            reason = self.line.check(now)
            channel = self._channel
            if channel is not None and not reason:
                while (frame := self.line.next_frame(now)) is not None:
                    channel.send(frame)
        finally:
            self._is_busy = False
        if reason:
            self._close(reason)
        elif self.line.is_spent:
            self._close("")
        else:
            if self.line.is_connected and self.line.was_of_use:
                self._say("")
            self._set_timer(self.line.wake_at(), now)

    def _close(self, reason: str) -> None:
        """End the connection, if there is one; without a reason it is the agreed end of it."""
        channel, self._channel = self._channel, None
        if channel is None:
            return
        channel.close()
        if reason and not self.line.was_of_use:
            self._say(reason)
        now = clock.now()
        self._is_busy = True
        try:
            self.line.disconnected(reason, now)
        finally:
            self._is_busy = False
        self._changed.set()
        self._set_timer(self.line.wake_at(), now)

    def _say(self, reason: str) -> None:
        if reason != self._reported:
            self._reported = reason
            self._report(reason)

    def _set_timer(self, at: float, now: float) -> None:
        """Have a turn then; an earlier one that is set already will see to it."""
        if self._timer is not None:
            if self._timer_at <= at < NEVER:
                return
            self._timer.cancel()
            self._timer = None
        if at < NEVER and self._loop is not None:
            self._timer_at = at
            self._timer = self._loop.call_later(max(at - now, _SHORTEST_SLEEP), self._on_timer)

    def _on_timer(self) -> None:
        self._timer = None
        self._turn(clock.judged_now())
