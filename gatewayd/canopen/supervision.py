"""How a bus is judged: from what the kernel shows, what the controller reports and what sending fails with.

Pure. What is *seen* (a look at the interface) is the truth of that moment and counts in every state. What is *reported*
by an error frame comes at once, but may be old: it counts only while frames go through, so that a report read late from
the buffer cannot revive a bus that is down or off.
"""

from __future__ import annotations

import errno
from enum import Enum, auto
from types import MappingProxyType

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.errors import ControllerFlags, ErrorClass, ErrorFrame

LOOK = 0.1
"""Seconds between two looks at the interface."""
RETRY = 0.1
"""Seconds before the first attempt to open again; doubles with each failure."""
RETRY_LIMIT = 2.0
"""Longest wait before an attempt."""


class BusSignal(Enum):
    """What happens to a bus."""

    GONE = auto()
    """Seen: there is no such interface."""
    DOWN = auto()
    """Seen: it is down."""
    OFF = auto()
    """Seen: it is up, its controller off the bus."""
    PASSIVE = auto()
    """Seen: error-passive."""
    WARNING = auto()
    """Seen: error warning."""
    ACTIVE = auto()
    """Seen: error-active."""
    UP = auto()
    """Seen: it carries frames; how well, the driver does not say."""
    REPORTED_OFF = auto()
    REPORTED_PASSIVE = auto()
    REPORTED_WARNING = auto()
    REPORTED_ACTIVE = auto()
    REPORTED_RESTARTED = auto()
    """Reported: the controller is back on the bus."""


_SEEN = {
    BusSignal.GONE: BusState.ABSENT,
    BusSignal.DOWN: BusState.DOWN,
    BusSignal.OFF: BusState.BUS_OFF,
    BusSignal.PASSIVE: BusState.PASSIVE,
    BusSignal.WARNING: BusState.WARNING,
    BusSignal.ACTIVE: BusState.ACTIVE,
}
_REPORTED = {
    BusSignal.REPORTED_OFF: BusState.BUS_OFF,
    BusSignal.REPORTED_PASSIVE: BusState.PASSIVE,
    BusSignal.REPORTED_WARNING: BusState.WARNING,
    BusSignal.REPORTED_ACTIVE: BusState.ACTIVE,
}

TRANSITIONS = MappingProxyType(
    {(state, event): target for state in BusState for event, target in _SEEN.items()}
    | {(state, event): target for state in BusState if state.carries for event, target in _REPORTED.items()}
    | {
        (BusState.ABSENT, BusSignal.UP): BusState.ACTIVE,
        (BusState.DOWN, BusSignal.UP): BusState.ACTIVE,
        (BusState.BUS_OFF, BusSignal.UP): BusState.ACTIVE,
        (BusState.BUS_OFF, BusSignal.REPORTED_RESTARTED): BusState.ACTIVE,
    }
)
"""State and signal -> next state; what is not here changes nothing."""

_REPORTS = (
    (ControllerFlags.RX_PASSIVE | ControllerFlags.TX_PASSIVE, BusSignal.REPORTED_PASSIVE),
    (ControllerFlags.RX_WARNING | ControllerFlags.TX_WARNING, BusSignal.REPORTED_WARNING),
    (ControllerFlags.ACTIVE, BusSignal.REPORTED_ACTIVE),
)
FAILURES = {errno.ENETDOWN: BusSignal.DOWN, errno.ENODEV: BusSignal.GONE, errno.ENXIO: BusSignal.GONE}
"""What the error number of a failed send or receive says of the interface; others say nothing of it."""


def signal_of_error(error: ErrorFrame) -> BusSignal | None:
    """What an error frame says of the state; None if it says nothing of it."""
    if error.classes & ErrorClass.BUS_OFF:
        return BusSignal.REPORTED_OFF
    if error.classes & ErrorClass.RESTARTED:
        return BusSignal.REPORTED_RESTARTED
    return next((signal for flags, signal in _REPORTS if error.controller & flags), None)


class Supervisor:
    """The state of one bus, and when to try to open it again."""

    def __init__(self) -> None:
        self.state = BusState.ABSENT
        self._retry_at = 0.0
        self._wait = RETRY

    def feed(self, signal: BusSignal) -> bool:
        """Judge a signal; whether the state is another one now."""
        old, self.state = self.state, TRANSITIONS.get((self.state, signal), self.state)
        return self.state is not old

    def may_open(self, now: float) -> bool:
        """Whether it is time for an attempt."""
        return now >= self._retry_at

    def opened(self) -> None:
        """The attempt went well: after the next loss try again at once."""
        self._retry_at = 0.0
        self._wait = RETRY

    def failed(self, now: float) -> None:
        """It did not: the next one has to wait, longer each time."""
        self._retry_at = now + self._wait
        self._wait = min(2 * self._wait, RETRY_LIMIT)
