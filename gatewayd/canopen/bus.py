"""A CAN bus as the node sees it: what every driver offers, and whom it tells."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

from gatewayd.canopen.errors import ErrorFrame
from gatewayd.canopen.frame import Frame

__all__ = ["DRAIN", "Bus", "BusCounters", "BusError", "BusHandler", "BusState"]

DRAIN = 64
"""Most frames that a driver reads before the loop has its turn."""


class BusError(Exception):
    """The bus cannot be used as it is set up, now or later; the text says why and what to do."""


class BusState(IntEnum):
    """How well the bus carries frames; the order is that of usefulness. Nothing is sent up to BUS_OFF."""

    ABSENT = 0
    """No such interface: the adapter is not plugged in."""
    DOWN = 1
    """The interface is not configured, or was taken down."""
    BUS_OFF = 2
    """The controller has cut itself off after too many errors."""
    PASSIVE = 3
    """Error-passive: frames go through, but the controller can no longer signal errors."""
    WARNING = 4
    """An error counter has reached 96."""
    ACTIVE = 5

    @property
    def carries(self) -> bool:
        """Whether frames go through."""
        return self >= BusState.PASSIVE


@dataclass(slots=True)
class BusCounters:
    """Since the driver was made."""

    received: int = 0
    """Data and remote frames that were handed on."""
    sent: int = 0
    """Frames that the driver took."""
    refused: int = 0
    """Frames that it did not take: no room, or the bus carries nothing."""
    errors: int = 0
    """Error frames."""
    lost: int = 0
    """Received frames that found no room in the receive buffer."""
    opened: int = 0
    """Times that the interface was opened."""
    bus_off: int = 0
    """Times that the controller went off the bus."""
    receive_buffer: int = 0
    """Bytes that were granted for received frames; 0: not known."""
    tx_errors: int = 0
    """The controller's transmit error counter, as last told."""
    rx_errors: int = 0
    """Its receive error counter."""


class BusHandler(Protocol):
    """Whom a driver tells. Called from within the loop; must not raise. `now` is monotonic seconds."""

    def on_frames(self, frames: list[Frame], now: float) -> None:
        """Received frames in their order, at most `DRAIN`."""

    def on_error(self, error: ErrorFrame, now: float) -> None:
        """The controller reports an error; a change of state that follows from it is told by `on_state` after it."""

    def on_lost(self, count: int, now: float) -> None:
        """So many received frames found no room and are lost (EMCY 8110h)."""

    def on_state(self, state: BusState, reason: str, now: float) -> None:
        """The bus is in another state now."""

    def on_writable(self, now: float) -> None:
        """A frame was refused for want of room; now there may be some."""


class Bus(Protocol):
    """A driver: reopens by itself whatever comes back, and never configures an interface."""

    counters: BusCounters

    @property
    def state(self) -> BusState:
        """ABSENT until it is opened."""

    @property
    def bitrate(self) -> int | None:
        """Bit/s that the controller is really set to, where that can be known."""

    async def open(self) -> None:
        """Start. An interface that is not there is waited for; BusError if waiting cannot help."""

    def close(self) -> None:
        """Stop, without a last `on_state`."""

    def send(self, frame: Frame) -> bool:
        """Hand over a frame, without waiting. False: not now; `on_writable` or `on_state` will tell when."""

    def lags(self, bit_rate: int | None) -> bool:
        """Whether a frame that is sent now would be late, because older ones still wait for the bus."""

    def catch_up(self) -> bool:
        """Hand over all received frames that wait, instead of leaving the loop its turns in between.

        False: they were so many that it has to be called again.
        """

    def set_filters(self, can_ids: Iterable[int], remote_ids: Iterable[int] = ()) -> None:
        """Receive data frames of `can_ids` and remote frames of `remote_ids`, and nothing else."""
