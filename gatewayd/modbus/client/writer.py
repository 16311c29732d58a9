"""How the writes of one unit are carried out: parts of registers take one request or two. Pure."""

from __future__ import annotations

from collections.abc import Hashable
from enum import Enum, auto
from typing import NamedTuple

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.polling import AT_ONCE
from gatewayd.modbus.client.requests import (
    ExceptionAnswer,
    Failure,
    ModbusRequest,
    mask_register,
    read,
    write_register,
)
from gatewayd.modbus.client.writes import PartWrite, WriteOrder, WriteQueue
from gatewayd.modbus.exceptions import ExceptionCode


class _Step(Enum):
    PLAIN = auto()
    MASK = auto()
    READ = auto()


class WriteResult(NamedTuple):
    """What became of a write in the end."""

    key: Hashable
    failure: Failure | None
    """None: the unit has confirmed it."""


class UnitWriter:
    """One write after the other. Between reading a register and writing it back nothing else is written."""

    __slots__ = ("_has_mask_write", "_key", "_merged", "_order", "_queue", "_step")

    def __init__(self, *, has_mask_write: bool) -> None:
        self._queue = WriteQueue()
        self._has_mask_write = has_mask_write
        self._step = _Step.PLAIN
        self._key: Hashable = None
        self._order: WriteOrder | None = None
        self._merged: ModbusRequest | None = None

    @property
    def due(self) -> float:
        """From when the next request may go out."""
        return self._queue.due if self._merged is None else AT_ONCE

    def put(self, key: Hashable, order: WriteOrder, repeat: float | None, now: float) -> bool:
        """See `WriteQueue.put`."""
        return self._queue.put(key, order, repeat, now)

    def cancel(self, key: Hashable) -> None:
        """See `WriteQueue.cancel`."""
        self._queue.cancel(key)

    def clear(self) -> int:
        """See `WriteQueue.clear`."""
        if self._merged is not None:
            self._merged = None
            self._queue.put_back()
        return self._queue.clear()

    def take(self, now: float) -> ModbusRequest:
        """The next request, to be sent now. Only when `due` has come."""
        if self._merged is not None:
            merged, self._merged = self._merged, None
            self._step = _Step.PLAIN
            return merged
        self._key, order = self._queue.take(now)
        self._order = order
        if not isinstance(order, PartWrite):
            self._step = _Step.PLAIN
            return order
        if not self._has_mask_write:
            self._step = _Step.READ
            return read(Area.HOLDING, order.address, 1)
        self._step = _Step.MASK
        return mask_register(order.address, ~order.mask & 0xFFFF, order.value & order.mask)

    def done(self, outcome: bytes | Failure, now: float) -> WriteResult | None:
        """The last request has this outcome. The end of the write, if that was it."""
        if not isinstance(outcome, bytes):
            return self._failed(outcome, now)
        if self._step is _Step.READ:
            assert isinstance(self._order, PartWrite)
            register = self._order.merged(int.from_bytes(outcome, "big"))
            self._merged = write_register(self._order.address, register.to_bytes(2, "big"))
            return None
        self._queue.confirmed()
        return WriteResult(self._key, None)

    def put_back(self) -> None:
        """The last request was lost with its connection, which says nothing about the unit: from the start again."""
        self._queue.put_back()

    def _failed(self, failure: Failure, now: float) -> WriteResult | None:
        if (
            self._step is _Step.MASK
            and isinstance(failure, ExceptionAnswer)
            and failure.code == ExceptionCode.ILLEGAL_FUNCTION
        ):
            self._has_mask_write = False
            self._queue.put_back()
            return None
        return WriteResult(self._key, failure) if self._queue.failed(failure, now) else None
