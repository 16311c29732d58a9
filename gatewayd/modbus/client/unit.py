"""What a link declares of a unit, and what it hears of it."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

from gatewayd.modbus.client.breaker import BreakerSettings
from gatewayd.modbus.client.grouping import PollClass, ReadGroup, WantedItem
from gatewayd.modbus.client.identity import UnitIdentity
from gatewayd.modbus.client.requests import Failure

DEFAULT_TIMEOUT = 0.3


class UnitState(Enum):
    """Whether a unit is there."""

    CONNECTING = "connecting"
    """It has not answered yet, and was not asked in vain yet."""
    ONLINE = "online"
    LOST = "lost"
    """What was read from it may not be true any more."""


class StationListener(Protocol):
    """What a station calls, on the loop and in the middle of its work: it must be quick and must not raise.

    It may call `Station.write` and `cancel`.
    """

    def values_read(self, group: ReadGroup, data: bytes, now: float) -> None:
        """A group was read: registers as 2 bytes each, high byte first; bits from the lowest of the first byte on."""

    def read_failed(self, group: ReadGroup, failure: Failure, now: float) -> None:
        """A group was not read this time; it will be tried again in its turn. The unit may be there all the same."""

    def write_done(self, key: Hashable, failure: Failure | None, now: float) -> None:
        """A write was confirmed (None), or given up. Those that gave way to a newer one are not reported."""

    def state_changed(self, state: UnitState, reason: str, now: float) -> None:
        """The unit is there, or lost, and the reason in words. Writes that waited are forgotten when it is lost."""

    def connection_renewed(self, now: float) -> None:
        """It answers on another connection, though it was not lost in between: it may have begun anew all the same."""

    def identified(self, identity: UnitIdentity, former: UnitIdentity | None, now: float) -> None:
        """It was identified, whenever it or its connection is back; `former` is None at the first time.

        Before the first values after it was lost.
        """


@dataclass(frozen=True, slots=True)
class StationSettings:
    """One unit of a line."""

    unit: int
    """Address: 1..247; on TCP also 0 and 255, which mean the device itself."""
    polls: tuple[PollClass, ...] = ()
    timeout: float = DEFAULT_TIMEOUT
    """Seconds for an answer. Behind a gateway it should be longer than the gateway's own time-out."""
    breaker: BreakerSettings = field(default_factory=BreakerSettings)
    in_flight: int = 1
    """Requests of this unit at the same time, at most, on a line that allows several. Writes go one at a time."""
    has_mask_write: bool = True
    """Whether parts of registers are written by FC 22. A unit that refuses it is not asked for it again."""
    is_identified: bool = False
    """Whether to ask for FC 43/14 whenever it is found."""
    serial: WantedItem | None = None
    """Registers with a serial number, read whenever it is found."""
    keepalive: float = 1.0
    """Seconds between two requests to a unit of which nothing is read, so that its loss is noticed."""
