"""What waits for the bus: the newest of each cyclic frame, and everything else in order.

Pure: frames in, frames out through a callable. Which of two waiting frames goes first follows the arbitration of CAN:
the lower COB-ID wins, so EMCY passes PDOs, and PDOs pass SDO. Nothing overtakes anything within EVENT (a boot-up
message stays before the first EMCY) and within ORDERED, and neither takes the other's room. NEWEST frames take turns,
so that a node with more PDOs than the bus can carry still has a heartbeat; after `PATIENCE` of them in a row one
other frame goes out whatever its COB-ID, so that it answers SDO too.

What has waited while nothing went out at all for `STUCK` seconds is old: the cyclic frames are made anew as they would
be sent now (`Renew`), or dropped. A SYNC never waits.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from gatewayd.canopen.frame import Frame, Priority

ORDERED_CAPACITY = 256
"""ORDERED frames that may wait: a whole SDO block (127 segments) and what comes up meanwhile."""
EVENT_CAPACITY = 64
"""EVENT frames that may wait; of more of them the oldest are lost, because the last ones say how things stand."""
NEWEST_CAPACITY = 513
"""COB-IDs of cyclic frames that may wait: as many as a node can have TPDOs, and its heartbeat."""
PATIENCE = 8
"""NEWEST frames that may pass another waiting frame before it is its turn."""
STUCK = 0.1
"""Seconds without a frame that was taken after which the cyclic frames that wait are old."""

Renew = Callable[[int], Frame | None]
"""The frame that would be sent with this COB-ID now; None if there is none."""


class TransmitQueue:
    """Frames that wait. Bounded: a frame that finds no room is dropped and counted."""

    def __init__(self) -> None:
        self.overflow = 0
        """Frames that found no room."""
        self.replaced = 0
        """Cyclic frames that were replaced or dropped before they were sent, because they had become old."""
        self._ordered: deque[Frame] = deque()
        self._events: deque[Frame] = deque()
        self._newest: dict[int, Frame] = {}
        self._passed = 0

    def __len__(self) -> int:
        return len(self._ordered) + len(self._events) + len(self._newest)

    def put(self, frame: Frame, priority: Priority) -> bool:
        """Add a frame; a cyclic one takes the place of the one of its COB-ID that waits. False if there is no room."""
        if priority is Priority.NEWEST:
            return self._put_newest(frame)
        if priority is Priority.EVENT:
            self._put_event(frame)
            return True
        if len(self._ordered) >= ORDERED_CAPACITY:
            self.overflow += 1
            return False
        self._ordered.append(frame)
        return True

    def drain(self, offer: Callable[[Frame], bool]) -> bool:
        """Offer the frames in their order until one is not taken, which stays. True if nothing waits any more."""
        newest = self._newest
        while self:
            line = self._next_in_line()
            if newest and (line is None or self._goes_before(line[0])):
                can_id = next(iter(newest))
                if not offer(newest[can_id]):
                    return False
                del newest[can_id]
                self._passed = self._passed + 1 if line is not None else 0
            else:
                assert line is not None
                if not offer(line[0]):
                    return False
                line.popleft()
                self._passed = 0
        return True

    def renew(self, renew: Renew) -> None:
        """Make every cyclic frame that waits anew, and drop those that there would be none of now."""
        for can_id in list(self._newest):
            frame = renew(can_id)
            self.replaced += 1
            if frame is None:
                del self._newest[can_id]
            else:
                self._newest[can_id] = frame

    def clear(self) -> int:
        """Forget everything that waits; how many frames that were."""
        waiting = len(self)
        self._ordered.clear()
        self._events.clear()
        self._newest.clear()
        self._passed = 0
        return waiting

    def _put_newest(self, frame: Frame) -> bool:
        if frame.can_id in self._newest:
            self.replaced += 1
        elif len(self._newest) >= NEWEST_CAPACITY:
            self.overflow += 1
            return False
        self._newest[frame.can_id] = frame
        return True

    def _put_event(self, frame: Frame) -> None:
        # A heartbeat from before a boot-up message must not follow it.
        if self._newest.pop(frame.can_id, None) is not None:
            self.replaced += 1
        if len(self._events) >= EVENT_CAPACITY:
            self.overflow += 1
            self._events.popleft()
        self._events.append(frame)

    def _next_in_line(self) -> deque[Frame] | None:
        """Whose first frame goes before those of the other line."""
        events, ordered = self._events, self._ordered
        if events and (not ordered or events[0].can_id <= ordered[0].can_id):
            return events
        return ordered or None

    def _goes_before(self, frame: Frame) -> bool:
        """Whether a cyclic frame goes before this one."""
        return self._passed < PATIENCE and min(self._newest) < frame.can_id


class Transmitter:
    """Sends at once where the bus takes a frame, and queues where it does not.

    `offer` is the bus's `send`: False if it takes nothing now; `punctual` the same for a frame that may not be late.
    `send` is a `gatewayd.canopen.frame.Send`.
    Closed, it drops what it is given: what was meant for a bus that was away must not be sent when it is back.
    While `overdue` says that the process stood still since the frames were made, cyclic ones wait to be made anew
    (`renew`, then `flush`).
    """

    def __init__(
        self,
        offer: Callable[[Frame], bool],
        renew: Renew,
        *,
        now: Callable[[], float],
        punctual: Callable[[Frame], bool] | None = None,
        overdue: Callable[[], bool] = lambda: False,
    ) -> None:
        self.queue = TransmitQueue()
        self.discarded = 0
        """Frames that were dropped because the bus was away, or because they may not wait."""
        self._offer = offer
        self._punctual = offer if punctual is None else punctual
        self._overdue = overdue
        self._renew = renew
        self._now = now
        self._moved = 0.0
        """When a frame was taken last, or began to wait while none waited."""
        self._open = False

    def open(self) -> None:
        """The bus carries frames from now on."""
        self._open = True

    def close(self) -> None:
        """The bus carries none any more; forget what waits."""
        self._open = False
        self.discarded += self.queue.clear()

    def send(self, frame: Frame, priority: Priority) -> bool:
        """Hand a frame on; never waits, never fails. False if it was dropped."""
        if priority is Priority.AT_ONCE:
            taken = self._open and not self._overdue() and self._punctual(frame)
            self.discarded += not taken
            return taken
        old = priority is Priority.NEWEST and self._overdue()
        if self._open and not self.queue and not old and self._offer(frame):
            return True
        # Asked again: a bus that fails at the frame it is offered closes us, and will never report room for that one.
        if not self._open:
            self.discarded += 1
            return False
        if not self.queue:
            self._moved = self._now()
        return self.queue.put(frame, priority)

    def flush(self) -> None:
        """The bus takes frames again: send what waits."""
        if not self._open or not self.queue:
            return
        if self._now() - self._moved > STUCK:
            self.queue.renew(self._renew)
        before = len(self.queue)
        self.queue.drain(self._offer)
        if len(self.queue) < before:
            self._moved = self._now()

    def renew(self) -> None:
        """What waits is old: the process stood still."""
        self.queue.renew(self._renew)
