"""SDO transfers with nodes of a bus that this program does not manage: a driver, a channel for each node, a timer.

No NMT command, no heartbeat and no SYNC is sent: what is on the bus stays as it is.
"""

from __future__ import annotations

import asyncio
import math
from types import TracebackType
from typing import Self

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.dictionary import AbortCode
from gatewayd.canopen.drivers import make_bus
from gatewayd.canopen.errors import ErrorFrame
from gatewayd.canopen.frame import Frame
from gatewayd.canopen.manager.channel import SdoChannel, SdoJob
from gatewayd.canopen.queue import Transmitter
from gatewayd.canopen.sdo.client import SdoResult
from gatewayd.loop import clock

OPEN_LIMIT = 2.0
"""Seconds for the bus to carry frames."""


class DirectBus:
    """A bus while the context lasts. Raises BusError, or `BusAway` where it carries no frames."""

    def __init__(self, interface: str, channel: str, bitrate: int, timeout: float) -> None:
        """`timeout`: seconds for each answer of a node."""
        self.reason = ""
        """Why the bus carries no frames, in words; empty while it does."""
        self._timeout = timeout
        self._bus = make_bus(interface, channel, bitrate, self)
        self._carries = asyncio.Event()
        self._transmitter = Transmitter(self._bus.send, lambda _can_id: None, now=clock.now)
        self._channels: dict[int, SdoChannel] = {}
        self._timer: asyncio.TimerHandle | None = None

    async def __aenter__(self) -> Self:
        """Open it."""
        self._bus.set_filters(frozenset(Function.SDO_RESPONSE + node for node in range(1, 128)))
        await self._bus.open()
        try:
            async with asyncio.timeout(OPEN_LIMIT):
                await self._carries.wait()
        except TimeoutError:
            self._bus.close()
            raise BusAway(self.reason or self._bus.reason or "it carries no frames") from None
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        if self._timer is not None:
            self._timer.cancel()
        self._transmitter.flush()
        self._bus.close()

    async def transfer(self, node: int, index: int, subindex: int, data: bytes | None = None) -> SdoResult:
        """Read an object of a node, or write `data` to it. Transfers with several nodes may run at a time."""
        ended: asyncio.Future[SdoResult] = asyncio.get_running_loop().create_future()

        def done(result: SdoResult, _now: float) -> None:
            if not ended.done():
                ended.set_result(result)

        if node not in self._channels:
            self._channels[node] = SdoChannel(node, self._transmitter.send, self._timeout)
        now = clock.now()
        if not self._channels[node].put(SdoJob(index, subindex, data, done), now):
            return SdoResult(index, subindex, code=AbortCode.NO_RESOURCE)
        self._schedule(now)
        return await ended

    # -- called by the driver ------------------------------------------------------------------------------------

    def on_frames(self, frames: list[Frame], now: float) -> None:
        """Received frames."""
        for frame in frames:
            channel = self._channels.get(frame.can_id - Function.SDO_RESPONSE)
            if channel is not None:
                channel.receive(frame, now)
        self._schedule(now)

    def on_error(self, error: ErrorFrame, now: float) -> None:
        """An error frame; what follows from it comes as a state."""

    def on_lost(self, count: int, now: float) -> None:
        """Frames were lost: their transfers time out."""

    def on_state(self, state: BusState, reason: str, now: float) -> None:
        """The bus is in another state."""
        self.reason = "" if state.carries else reason
        if state.carries:
            self._transmitter.open()
            self._carries.set()
        else:
            self._transmitter.close()

    def on_writable(self, now: float) -> None:
        """There is room in the driver again."""
        self._transmitter.flush()

    def _schedule(self, now: float) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        due = min((channel.next_deadline() for channel in self._channels.values()), default=math.inf)
        if due < math.inf:
            self._timer = asyncio.get_running_loop().call_at(max(due, now), self._tick)

    def _tick(self) -> None:
        now = clock.now()
        self._timer = None
        for channel in self._channels.values():
            channel.tick(now)
        self._schedule(now)


class BusAway(Exception):
    """The bus carries no frames; the text says why."""
