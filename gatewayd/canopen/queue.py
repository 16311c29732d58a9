"""What waits for the bus: the newest of each PDO, and everything else in order.

Pure: frames in, frames out through a callable. Which of two waiting frames goes first follows the arbitration of CAN:
the lower COB-ID wins, so SYNC, NMT and EMCY pass PDOs, and PDOs pass SDO and heartbeat. Within ORDERED nothing
overtakes anything (a boot-up message stays before the first EMCY), and after `PATIENCE` PDOs in a row one ORDERED frame
goes out whatever its COB-ID: a node that has more PDOs than the bus can carry still has a heartbeat and answers SDO.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from gatewayd.canopen.frame import Frame, Priority

__all__ = ["ORDERED_CAPACITY", "PATIENCE", "PDO_CAPACITY", "TransmitQueue", "Transmitter"]

ORDERED_CAPACITY = 256
"""ORDERED frames that may wait: a whole SDO block (127 segments) and what comes up meanwhile."""
PDO_CAPACITY = 512
"""COB-IDs of PDOs that may wait: as many as a node can have TPDOs."""
PATIENCE = 8
"""PDOs that may pass a waiting ORDERED frame before it is its turn."""


class TransmitQueue:
    """Frames that wait. Bounded: a frame that finds no room is dropped and counted."""

    def __init__(self, ordered_capacity: int = ORDERED_CAPACITY, pdo_capacity: int = PDO_CAPACITY) -> None:
        self.overflow = 0
        """Frames that found no room."""
        self.replaced = 0
        """PDOs that a newer one of their COB-ID replaced before they were sent."""
        self._ordered: deque[Frame] = deque()
        self._pdos: dict[int, Frame] = {}
        self._ordered_capacity = ordered_capacity
        self._pdo_capacity = pdo_capacity
        self._passed = 0

    def __len__(self) -> int:
        return len(self._ordered) + len(self._pdos)

    def put(self, frame: Frame, priority: Priority) -> bool:
        """Add a frame; a PDO takes the place of the one of its COB-ID that waits. False if there is no room."""
        if priority is Priority.PDO:
            if frame.can_id in self._pdos:
                self.replaced += 1
            elif len(self._pdos) >= self._pdo_capacity:
                self.overflow += 1
                return False
            self._pdos[frame.can_id] = frame
            return True
        if len(self._ordered) >= self._ordered_capacity:
            self.overflow += 1
            return False
        self._ordered.append(frame)
        return True

    def drain(self, offer: Callable[[Frame], bool]) -> bool:
        """Offer the frames in their order until one is not taken, which stays. True if nothing waits any more."""
        ordered, pdos = self._ordered, self._pdos
        while ordered or pdos:
            pdo = next(iter(pdos)) if pdos else None
            if pdo is None or (ordered and (ordered[0].can_id < pdo or self._passed >= PATIENCE)):
                if not offer(ordered[0]):
                    return False
                ordered.popleft()
                self._passed = 0
            else:
                if not offer(pdos[pdo]):
                    return False
                del pdos[pdo]
                self._passed = self._passed + 1 if ordered else 0
        return True

    def clear(self) -> int:
        """Forget everything that waits; how many frames that were."""
        waiting = len(self)
        self._ordered.clear()
        self._pdos.clear()
        self._passed = 0
        return waiting


class Transmitter:
    """Sends at once where the bus takes a frame, and queues where it does not.

    `offer` is the bus's `send`: False if it takes nothing now. `send` is a `gatewayd.canopen.frame.Send`.
    Closed, it drops what it is given: what was meant for a bus that was away must not be sent when it is back.
    """

    def __init__(self, offer: Callable[[Frame], bool], queue: TransmitQueue | None = None) -> None:
        self.queue = TransmitQueue() if queue is None else queue
        self.discarded = 0
        """Frames that were dropped because the bus was away."""
        self._offer = offer
        self._open = False

    def open(self) -> None:
        """The bus carries frames from now on."""
        self._open = True

    def close(self) -> None:
        """The bus carries none any more; forget what waits."""
        self._open = False
        self.discarded += self.queue.clear()

    def send(self, frame: Frame, priority: Priority) -> None:
        """Hand a frame on; never waits, never fails."""
        if self._open and not self.queue and self._offer(frame):
            return
        # Asked again: a bus that fails at the frame it is offered closes us, and will never tell of room for that one.
        if self._open:
            self.queue.put(frame, priority)
        else:
            self.discarded += 1

    def flush(self) -> None:
        """The bus takes frames again: send what waits."""
        if self._open:
            self.queue.drain(self._offer)
