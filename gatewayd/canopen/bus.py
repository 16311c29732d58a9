"""How a CAN bus is, and to whom its driver reports."""

from __future__ import annotations

from enum import IntEnum
from typing import Protocol

from gatewayd.canopen.errors import ErrorFrame
from gatewayd.canopen.frame import Frame

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


class BusHandler(Protocol):
    """To whom a driver reports. Called from within the loop; must not raise. `now` is monotonic seconds."""

    def on_frames(self, frames: list[Frame], now: float) -> None:
        """Received frames in their order, at most `DRAIN`."""

    def on_error(self, error: ErrorFrame, now: float) -> None:
        """The controller reports an error; the state that follows from it is reported by `on_state` afterwards."""

    def on_lost(self, count: int, now: float) -> None:
        """So many received frames found no room and are lost (EMCY 8110h)."""

    def on_state(self, state: BusState, reason: str, now: float) -> None:
        """The bus is in another state now."""

    def on_writable(self, now: float) -> None:
        """A frame was refused for want of room; now there may be some."""
