"""SYNC: heard, counted and, if this node is the producer, sent (CiA 301, 7.2.5 and 7.5.2.5 to .7, .21)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from gatewayd.canopen.cob_ids import BASIC_FRAME, is_assignable
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Entry, Object, variable
from gatewayd.canopen.frame import Frame, Priority, Send

PRODUCER = 0x4000_0000
"""Bit 30 of 1005h: this node sends SYNC."""
_DO_NOT_CARE = 0x8000_0000
MAX_COUNTER = 240
MIN_PERIOD = 1000
"""Microseconds: a shorter cycle would fill the bus, and no timer of this node keeps it."""


@dataclass(frozen=True, slots=True)
class SyncPlan:
    """What this node has to do with SYNC."""

    cob_id: int = 0x80
    producer: bool = False
    period: int = 0
    """Communication cycle period in us; 0: none."""
    counter: int = 0
    """Synchronous counter overflow value; 0: SYNC carries no counter."""
    window: int = 0
    """Synchronous window length in us; 0: none."""


class SyncService:
    """The SYNC object.

    `on_sync(counter, now)` is called for every SYNC of the right length, our own ones included; the counter is None
    if SYNC carries none. `wrong_length(length, now)` is called for every other one, which does nothing else.
    `allowed()` says whether the NMT state lets SYNC run; `changed()` is called when the COB-ID changes.
    """

    def __init__(
        self,
        send: Send,
        plan: SyncPlan,
        *,
        allowed: Callable[[], bool],
        on_sync: Callable[[int | None, float], None],
        wrong_length: Callable[[int, float], None],
        changed: Callable[[], None],
    ) -> None:
        self._send = send
        self._allowed = allowed
        self._on_sync = on_sync
        self._wrong_length = wrong_length
        self._cob_id_changed = changed
        self._due = math.inf
        self._counter = 0
        self._last = -math.inf
        self.count = 0
        """SYNC messages heard or sent."""
        u8, u32, changed = CanType.UNSIGNED8, CanType.UNSIGNED32, self._configured
        cob_id = plan.cob_id | (PRODUCER if plan.producer else 0)
        self._cob_id = Entry.parameter(
            0, "COB-ID SYNC", u32, cob_id, check=self._check_cob_id, changed=changed
        )
        self._period = Entry.parameter(
            0, "Communication cycle period", u32, plan.period, check=_check_period, changed=changed
        )
        self._window = Entry.parameter(0, "Synchronous window length", u32, plan.window)
        self._overflow = Entry.parameter(
            0, "Synchronous counter overflow value", u8, plan.counter, check=self._check_overflow
        )

    @property
    def cob_id(self) -> int:
        """Where SYNC is heard and sent."""
        return self._cob_id.number & BASIC_FRAME

    @property
    def produces(self) -> bool:
        """Whether this node sends SYNC."""
        return bool(self._cob_id.number & PRODUCER) and self._period.number > 0

    def objects(self) -> Iterable[Object]:
        """1005h, 1006h, 1007h, 1019h."""
        yield variable(0x1005, self._cob_id)
        yield variable(0x1006, self._period)
        yield variable(0x1007, self._window)
        yield variable(0x1019, self._overflow)

    def restart(self, now: float) -> None:
        """Begin anew with the parameters as they are: counter 1, the first own SYNC after one period."""
        self._counter = 0
        self._last = -math.inf
        self._due = now + self._period.number / 1e6 if self.produces else math.inf

    def resume(self, former: SyncService) -> None:
        """Go on as another one: in its cycle, with its counter."""
        self._counter, self._last, self._due = former._counter, former._last, former._due

    def stopped(self) -> None:
        """The node has been stopped: the counter begins with 1 when it goes on."""
        self._counter = 0

    def receive(self, frame: Frame, now: float) -> None:
        """A frame with the COB-ID of SYNC."""
        if frame.remote or not self._allowed():
            return
        if len(frame.data) != (1 if self._overflow.number else 0):
            self._wrong_length(len(frame.data), now)
            return
        self._sync(frame.data[0] if frame.data else None, now)

    def window_open(self, now: float) -> bool:
        """Whether synchronous PDOs may still be sent and taken: always without a window (1007h = 0)."""
        window = self._window.number
        return window == 0 or now - self._last <= window / 1e6

    def tick(self, now: float) -> None:
        """Send the SYNC that is due. Cycles that were missed are not made up for.

        A SYNC that the bus did not take is none: it is dropped rather than late, the counter counts those that were
        transmitted (CiA 301, 7.2.5), and nothing happens with it here that happens nowhere else.
        """
        if now < self._due:
            return
        period = self._period.number / 1e6
        self._due = self._due + period if now < self._due + period else now + period
        if not self._allowed():
            return
        overflow = self._overflow.number
        counter = self._counter % overflow + 1 if overflow else None
        frame = Frame(self.cob_id, b"" if counter is None else bytes([counter]))
        if self._send(frame, Priority.AT_ONCE):
            self._counter = counter or 0
            self._sync(counter, now)

    def next_deadline(self, now: float) -> float:
        """When `tick` has something to do."""
        return self._due

    def _sync(self, counter: int | None, now: float) -> None:
        self._last = now
        self.count += 1
        self._on_sync(counter, now)

    def _configured(self) -> None:
        # The first SYNC has to come within one period: the next tick sends it.
        self._counter = 0
        self._due = -math.inf if self.produces else math.inf
        self._cob_id_changed()

    def _check_cob_id(self, data: bytes) -> None:
        new, old = int.from_bytes(data, "little"), self._cob_id.number
        moved = old & new & PRODUCER and (old ^ new) & BASIC_FRAME
        if moved or not is_assignable(new, PRODUCER | _DO_NOT_CARE):
            raise Abort(AbortCode.INVALID_VALUE)

    def _check_overflow(self, data: bytes) -> None:
        if data[0] == 1 or data[0] > MAX_COUNTER:
            raise Abort(AbortCode.INVALID_VALUE)
        # Whoever loads a configuration writes 1006h first, and then what is here already.
        if self._period.number and data[0] != self._overflow.number:
            raise Abort(AbortCode.DEVICE_STATE)


def _check_period(data: bytes) -> None:
    if 0 < int.from_bytes(data, "little") < MIN_PERIOD:
        raise Abort(AbortCode.VALUE_TOO_LOW)
