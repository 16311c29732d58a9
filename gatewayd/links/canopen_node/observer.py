"""What a node counts, and who learns of what is not for the bus."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from gatewayd.canopen.nmt import NmtState


class Observer:
    """Gets what a node has to report that is not for the bus; does nothing by itself."""

    def cob_ids_changed(self) -> None:
        """`Node.cob_ids` or `Node.remote_ids` is another one now."""

    def nmt_changed(self, old: NmtState, new: NmtState, now: float) -> None:
        """The NMT state is another one now."""

    def deadline_changed(self) -> None:
        """Something that took its time has ended: `Node.next_deadline` is another one now."""

    def report(self, text: str) -> None:
        """Something for the log."""

    def time_received(self, moment: datetime, now: float) -> None:
        """The network's wall clock (TIME)."""

    def switch_bit_rate(self, bit_rate: int, delay: float, now: float) -> None:
        """An LSS master demands it: be silent for `delay` seconds, switch, be silent for as long again."""


class Timed(Protocol):
    """A service of the node that time moves on."""

    def tick(self, now: float) -> None:
        """Do what is due."""

    def next_deadline(self, now: float) -> float:
        """When that is; infinity if time alone brings nothing."""


@dataclass(slots=True)
class NodeCounters:
    """Since the node was made."""

    received: int = 0
    """Frames that were handed to the node."""
    ignored: int = 0
    """Frames with a COB-ID that means nothing in the present NMT state."""
    outside_window: int = 0
    """Synchronous RPDOs that came after the synchronous window (1007h)."""
    communication_errors: int = 0
    """Losses of heartbeat, guarding or bus."""
    overruns: int = 0
    """Received frames that were lost."""
