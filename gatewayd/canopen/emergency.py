"""EMCY: the errors that are active, what was sent of them, and how fast (CiA 301, 7.2.7 and 7.5.2.2, .4, .17, .18).

An error is active from `raise_error` until `clear`; raising it again says nothing new. The first message of an error
has its code, the message 0000h says that the last active error has gone. Messages wait while the NMT state forbids
EMCY, while the inhibit time runs, and after more of them than `BURST` and `RATE` allow: a peer that makes an error come
and go cannot fill the bus with it. Up to `IN_ORDER` wait as they came; of more than these only the newest of each
error, and if more wait than `CAPACITY`, the oldest are lost, because the last ones say how things stand.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable
from enum import IntEnum, IntFlag
from functools import partial, reduce
from operator import or_

from gatewayd.canopen.cob_ids import BASIC_FRAME, INVALID, Function, is_assignable
from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Access, Entry, Object, array, variable
from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.loop.allowance import Allowance

CAPACITY = 32
"""Messages that may wait."""
IN_ORDER = 8
"""Messages that wait before one of them is replaced by a newer one of its error."""
BURST = 16
"""Messages that may go out at once: more than one trouble of a cell has."""
RATE = 10.0
"""Messages a second after them, whatever 1015h says: 0.2 % of a bus of 500 kbit/s."""
HISTORY = 8
"""Errors kept in 1003h."""


class ErrorCode(IntEnum):
    """The emergency error codes that this node uses (CiA 301, table 26)."""

    NONE = 0x0000
    STORED_PARAMETERS = 0x6300
    """Data set: stored parameters could not be read."""
    OVERRUN = 0x8110
    PASSIVE = 0x8120
    HEARTBEAT = 0x8130
    """Life guarding or heartbeat error."""
    BUS_OFF_RECOVERED = 0x8140
    PDO_TOO_SHORT = 0x8210
    PDO_TOO_LONG = 0x8220
    SYNC_LENGTH = 0x8240
    RPDO_TIMEOUT = 0x8250
    COB_ID_COLLISION = 0x8150
    """Another node transmits with a COB-ID of this one."""
    WRITE_HELD = 0xFF01
    WRITE_OUT_OF_LIMITS = 0xFF02
    WRITE_ROBOT_LOST = 0xFF03
    WRITE_CLAIMED_ELSEWHERE = 0xFF04
    WRITE_NEVER = 0xFF05
    WRITE_HEARTBEAT_LOST = 0xFF06
    WRITE_PARTIAL_TAKEOVER = 0xFF07
    WRITE_WAITED = 0xFF08
    WRITE_CONTRADICTED = 0xFF09
    ROBOT_LOST = 0xFF10
    ROBOT_STALE = 0xFF11
    ROBOT_DIFFERS = 0xFF12
    ROBOT_UNAVAILABLE = 0xFF13


class Register(IntFlag):
    """Bits of the error register 1001h."""

    GENERIC = 0x01
    CURRENT = 0x02
    VOLTAGE = 0x04
    TEMPERATURE = 0x08
    COMMUNICATION = 0x10
    PROFILE = 0x20
    MANUFACTURER = 0x80


_REGISTERS = {
    0x2: Register.CURRENT,
    0x3: Register.VOLTAGE,
    0x4: Register.TEMPERATURE,
    0x8: Register.COMMUNICATION,
    0xF: Register.MANUFACTURER,
}


def register_of(code: int) -> Register:
    """The bits of 1001h that an error sets: always the generic one, and that of its class."""
    return Register.GENERIC | _REGISTERS.get(code >> 12, Register.GENERIC)


class Emergency:
    """The errors of one node. `allowed()` says whether the NMT state lets EMCY run; `inhibit` in 100 us (1015h)."""

    def __init__(self, send: Send, node: int, allowed: Callable[[], bool], inhibit: int = 0) -> None:
        self._send = send
        self._allowed = allowed
        self._active: dict[tuple[int, int], Register] = {}
        self._history: deque[int] = deque(maxlen=HISTORY)
        self._waiting: deque[tuple[tuple[int, int], bytes]] = deque(maxlen=CAPACITY)
        self._allowance = Allowance(BURST, RATE)
        self._not_before = -math.inf
        u32, default = CanType.UNSIGNED32, Function.EMCY + node
        self._cob_id = Entry.parameter(
            0, "COB-ID EMCY", u32, default, plus_node=True, check=self._check_cob_id
        )
        self._inhibit = Entry.parameter(0, "Inhibit time EMCY", CanType.UNSIGNED16, inhibit)

    @property
    def inhibit(self) -> float:
        """Seconds between two messages (1015h)."""
        return self._inhibit.number / 10_000

    @property
    def register(self) -> Register:
        """The error register."""
        return reduce(or_, self._active.values(), Register(0))

    def active(self, code: int, instance: int = 0) -> bool:
        """Whether the error is active."""
        return (code, instance) in self._active

    def objects(self) -> Iterable[Object]:
        """1001h, 1003h, 1014h, 1015h."""
        u8, u32 = CanType.UNSIGNED8, CanType.UNSIGNED32
        register = Entry(0, "Error register", u8, Access.RO, b"\0", source=lambda: bytes([self.register]))
        yield variable(0x1001, register)
        count = Entry(0, "Number of errors", u8, Access.RW, b"\0", source=self._count, sink=self._forget)
        fields = (
            Entry(n, f"Standard error field {n}", u32, Access.RO, bytes(4), source=partial(self._field, n))
            for n in range(1, HISTORY + 1)
        )
        yield array(0x1003, "Pre-defined error field", (count, *fields))
        yield variable(0x1014, self._cob_id)
        yield variable(0x1015, self._inhibit)

    def raise_error(self, code: int, now: float, data: bytes = b"", instance: int = 0) -> None:
        """An error has come. `data`: up to 5 bytes for the message, the first two of them also for 1003h.

        `instance` distinguishes errors of one code: a node-ID, a PDO's COB-ID.
        """
        if (code, instance) in self._active:
            return
        self._active[code, instance] = register_of(code)
        self._history.appendleft(code | int.from_bytes(data[:2], "little") << 16)
        self._queue(code, data, now, instance)

    def clear(self, code: int, now: float, instance: int = 0) -> None:
        """An error has gone; does nothing if it was not active."""
        if self._active.pop((code, instance), None) is not None and not self._active:
            self._queue(ErrorCode.NONE, b"", now)

    def judge(self, code: ErrorCode, wrong: bool, now: float) -> None:
        """The error is there, or it is not."""
        if wrong:
            self.raise_error(code, now)
        else:
            self.clear(code, now)

    def restart(self, *, forget: bool) -> None:
        """NMT reset: no active error, nothing waits; with `forget` (reset node) the history is empty as well."""
        self._active.clear()
        self._waiting.clear()
        self._not_before = -math.inf
        if forget:
            self._history.clear()

    def resume(self, former: Emergency) -> None:
        """Take over the errors of another one: active, sent and waiting to be sent."""
        self._active = former._active
        self._history = former._history
        self._waiting = former._waiting
        self._not_before = former._not_before
        self._allowance = former._allowance

    def tick(self, now: float) -> None:
        """Send what waits, if it may be sent now."""
        while self._waiting and self._allowed() and now >= self._not_before:
            if self._cob_id.number & INVALID:
                self._waiting.clear()
                return
            if not self._allowance.take(now):
                return
            _, message = self._waiting.popleft()
            self._send(Frame(self._cob_id.number & BASIC_FRAME, message), Priority.EVENT)
            if self._inhibit.number:
                self._not_before = now + self.inhibit

    def next_deadline(self, now: float) -> float:
        """When `tick` has something to do; a change of the NMT state makes it tick anyway."""
        if not self._waiting or not self._allowed():
            return math.inf
        return max(self._not_before, self._allowance.due(now))

    def _queue(self, code: int, data: bytes, now: float, instance: int = 0) -> None:
        message = code.to_bytes(2, "little") + bytes([self.register]) + data[:5].ljust(5, b"\0")
        if len(self._waiting) >= IN_ORDER:
            older = next((item for item in self._waiting if item[0] == (code, instance)), None)
            if older is not None:
                self._waiting.remove(older)
        self._waiting.append(((code, instance), message))
        self.tick(now)

    def _count(self) -> bytes:
        return bytes([len(self._history)])

    def _forget(self, data: bytes) -> None:
        if data != b"\0":
            raise Abort(AbortCode.INVALID_VALUE)
        self._history.clear()

    def _field(self, number: int) -> bytes:
        if number > len(self._history):
            raise Abort(AbortCode.NO_DATA)
        return self._history[number - 1].to_bytes(4, "little")

    def _check_cob_id(self, data: bytes) -> None:
        """Only 11-bit identifiers; another identifier only after the valid bit was taken away."""
        new, old = int.from_bytes(data, "little"), self._cob_id.number
        moved = new != old and not (new | old) & INVALID
        if moved or not is_assignable(new, INVALID):
            raise Abort(AbortCode.INVALID_VALUE)
