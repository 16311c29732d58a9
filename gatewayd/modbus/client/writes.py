"""Writes of one unit that wait for their turn. Pure; seconds of any one clock.

What is kept is bounded by the number of keys: of each key only the newest write waits. A write never overtakes one that
was asked for before it: where a newer one takes the place of an older one with the same key, it goes to the end. So
`a = 1, b = 1, a = 2` becomes `b = 1, a = 2`. What has to arrive together belongs in one request.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass
from typing import NamedTuple

from gatewayd.modbus.client.polling import NEVER
from gatewayd.modbus.client.requests import ExceptionAnswer, Failure, ModbusRequest

MAX_KEYS = 4096
MAX_TRIES = 3
"""A write that is not answered as often as this, while the unit answers others, is given up."""
RETRY_AFTER = 0.1
"""Seconds before a write is tried again that was not answered, or that the unit was too busy for."""


@dataclass(frozen=True, slots=True)
class PartWrite:
    """Part of a holding register: by FC 22, or where the unit has none by reading it and writing it back."""

    address: int
    mask: int
    """Bits that are written."""
    value: int
    """Their values, in place; bits outside `mask` do not matter."""

    def merged(self, register: int) -> int:
        """The register with the part in it."""
        return (register & ~self.mask & 0xFFFF) | (self.value & self.mask)


WriteOrder = ModbusRequest | PartWrite


class _Repeat(NamedTuple):
    order: WriteOrder
    every: float
    at: float


class WriteQueue:
    """One write at a time is underway; the others wait, each with a key of its own."""

    __slots__ = ("_failed_key", "_hold", "_is_forgotten", "_repeats", "_tries", "_underway", "_waiting")

    def __init__(self) -> None:
        self._waiting: OrderedDict[Hashable, WriteOrder] = OrderedDict()
        self._repeats: dict[Hashable, _Repeat] = {}
        self._underway: tuple[Hashable, WriteOrder] | None = None
        self._tries = 0
        self._failed_key: Hashable = None
        self._hold = float("-inf")
        self._is_forgotten = False

    def __len__(self) -> int:
        return len(self._waiting)

    @property
    def due(self) -> float:
        """From when the next write may go out; NEVER while one is underway or none is wanted."""
        if self._underway is not None:
            return NEVER
        if self._waiting:
            return self._hold
        return min((repeat.at for repeat in self._repeats.values()), default=NEVER)

    def put(self, key: Hashable, order: WriteOrder, repeat: float | None, now: float) -> bool:
        """Ask for a write; whether an older one with the key gave way to it. It is repeated every `repeat` seconds."""
        replaced = self._waiting.pop(key, None) is not None
        if len(self._waiting) >= MAX_KEYS:
            raise ValueError(f"more than {MAX_KEYS} writes wait for one unit")
        self._waiting[key] = order
        if repeat is None:
            self._repeats.pop(key, None)
        else:
            self._repeats[key] = _Repeat(order, repeat, now + repeat)
        return replaced

    def take(self, now: float) -> tuple[Hashable, WriteOrder]:
        """The next one, which is underway now. Only when `due` has come."""
        if not self._waiting:
            key = min(self._repeats, key=lambda key: self._repeats[key].at)
            self._waiting[key] = self._repeats[key].order
        key, order = self._waiting.popitem(last=False)
        if key in self._repeats:
            self._repeats[key] = self._repeats[key]._replace(at=now + self._repeats[key].every)
        self._underway = key, order
        self._is_forgotten = False
        return key, order

    def confirmed(self) -> None:
        """The unit has answered the one underway."""
        self._ended()
        self._tries = 0
        self._hold = float("-inf")

    def failed(self, failure: Failure, now: float) -> bool:
        """The one underway has failed. Whether it is given up; else it is the next, unless a newer one waits."""
        key, order = self._ended()
        is_refused = isinstance(failure, ExceptionAnswer) and failure.is_refusal
        self._tries = self._tries + 1 if key == self._failed_key else 1
        self._failed_key = key
        if is_refused or self._is_forgotten or self._tries >= MAX_TRIES:
            self._tries = 0
            self._hold = float("-inf")
            return True
        self._hold = now + RETRY_AFTER
        self._put_back(key, order)
        return False

    def put_back(self) -> None:
        """The one underway goes again, as if it had not been sent."""
        key, order = self._ended()
        if not self._is_forgotten:
            self._put_back(key, order)

    def cancel(self, key: Hashable) -> None:
        """Neither write nor repeat what the key stands for; what is underway is not called back."""
        self._waiting.pop(key, None)
        self._repeats.pop(key, None)

    def clear(self) -> int:
        """Forget all, repeats as well; how many waited. One underway is not tried again."""
        self._is_forgotten = True
        count = len(self._waiting)
        self._waiting.clear()
        self._repeats.clear()
        self._tries = 0
        self._hold = float("-inf")
        return count

    def _ended(self) -> tuple[Hashable, WriteOrder]:
        assert self._underway is not None
        ended, self._underway = self._underway, None
        return ended

    def _put_back(self, key: Hashable, order: WriteOrder) -> None:
        if key not in self._waiting:
            self._waiting[key] = order
            self._waiting.move_to_end(key, last=False)
