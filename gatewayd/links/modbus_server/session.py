"""One connection's requests: bytes in, answers out, in order, whatever the depth of pipelining. No input or output.

A single read of registers, or a usual write of them, is answered here at once: nearly all of the traffic. Everything
else goes to `gatewayd.links.modbus_server.functions`.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

from gatewayd.core.requester import Requester
from gatewayd.core.unserved import Unserved
from gatewayd.links.modbus_server.functions import Unit, exception, execute
from gatewayd.links.modbus_server.plan import default_of
from gatewayd.links.modbus_server.unserved import unknown_unit
from gatewayd.loop import clock
from gatewayd.modbus.areas import MAX_READ_REGISTERS
from gatewayd.modbus.exceptions import ExceptionCode
from gatewayd.modbus.frames import FrameBuffer, FramingError, encode, split

_READ_HOLDING = 3
_READ_INPUT = 4
_READ_FRAME = 12
_READ_LENGTH = 6
_unpack_read = struct.Struct(">2sHHHHH").unpack_from
"""Transaction id, protocol id, length, unit id and function, address, quantity."""
_WRITE_REGISTERS = 16
_WRITE_HEAD = 13
_unpack_write = struct.Struct(">2sHHHHHB").unpack_from
"""The same, and the count of bytes."""
_WRITTEN = bytes((0, 0, 0, 6))
"""What stands between transaction id and unit id in the answer to a write."""
_HEAD = struct.Struct(">HHBBB")
_AT_ONCE = 8
"""Requests of one connection that are answered before others have their turn, however many have come in."""
_THIS_DEVICE = (0, 255)
"""Unit ids by which a client on TCP means the device itself (Messaging on TCP/IP Guide V1.0b, 4.4.2.3)."""


class UnitAccess:
    """What a peer may do with one unit."""

    __slots__ = ("changed", "requester", "unit", "write", "writer_seen")

    def __init__(self, unit: Unit, requester: Requester) -> None:
        self.unit = unit
        self.requester = requester
        """The peer as a writer of the unit's cell, or as an undeclared one."""
        self.writer_seen = unit.cell.writer_seen
        self.changed = unit.image.changed
        self.write = unit.usual_registers.write


class ModbusSession:
    """The requests of one connection."""

    def __init__(self) -> None:
        self.buffer = FrameBuffer()
        self.broken = ""
        """Why the connection must be closed, once something came in that is no Modbus frame."""
        self.pending = False
        """Whether requests in the buffer still have to be answered, by calls with a count of 0."""
        self._accesses: dict[int, UnitAccess] = {}
        self._reads: dict[int, tuple[Any, bytearray, tuple[bytes, ...], UnitAccess]] = {}
        self._writes: dict[int, UnitAccess] = {}

    def serve(self, accesses: Mapping[int, UnitAccess]) -> None:
        """Answer for these units from now on. The only one, or the one declared for it, also answers to 0 and 255."""
        self._accesses = dict(accesses)
        default = default_of((unit, access.unit.plan) for unit, access in accesses.items())
        if default is not None:
            self._accesses.update(dict.fromkeys(_THIS_DEVICE, accesses[default]))
        self._reads = {}
        for unit, access in self._accesses.items():
            rights = access.unit.rights
            if rights is not None and not rights.reads_all:
                continue
            image = access.unit.image
            for function, table in ((_READ_HOLDING, image.holding), (_READ_INPUT, image.input)):
                key = unit << 8 | function
                self._reads[key] = (table.readable.reach, table.image, _heads(key), access)
        self._writes = {unit << 8 | _WRITE_REGISTERS: access for unit, access in self._accesses.items()}

    def received(self, count: int, now: float) -> bytes:
        """`count` bytes were written to `buffer.space`; returns the answers to the next requests that are complete."""
        buffer = self.buffer
        if count == _READ_FRAME and not buffer.end:
            transaction, protocol, length, key, address, quantity = _unpack_read(buffer.data)
            read = self._reads.get(key)
            if read is not None and length == _READ_LENGTH and not protocol:
                reach, image, heads, access = read
                if access.changed:
                    access.unit.image.refresh()
                if 0 < quantity <= reach[address]:
                    access.writer_seen(access.requester, now)
                    first = 2 * address
                    answer: bytes = transaction + heads[quantity] + image[first : first + 2 * quantity]
                    return answer
        elif count > _WRITE_HEAD and not buffer.end:
            transaction, protocol, length, key, address, quantity, size = _unpack_write(buffer.data)
            writing = self._writes.get(key)
            whole = count == size + _WRITE_HEAD == length + _WRITE_HEAD - 7 and size == 2 * quantity
            if writing is not None and whole and not protocol:
                data = bytes(buffer.data[_WRITE_HEAD:count])
                if writing.write(writing.requester, address, quantity, data, now):
                    return bytes(transaction + _WRITTEN + buffer.data[6:12])
        return self._answers(buffer.end + count, now)

    def received_late(self, count: int, now: float, waited: float) -> bytes:
        """The same for bytes that may have waited so many seconds while the gateway stood still.

        The cell hears of it with every request; it refuses commands that are too old and judges what is a sign of life.
        """
        return self._answers(self.buffer.end + count, now, waited)

    def _answers(self, end: int, now: float, waited: float = 0.0) -> bytes:
        """The answers to the next requests that are complete before `end` of the buffer."""
        answers: list[bytes] = []
        start = 0
        self.pending = False
        try:
            while (frame := split(self.buffer.data, start, end)) is not None:
                start = frame.end
                if clock.overdue():
                    # Stopped between two requests: those that follow have waited since they were read.
                    read_at, now = now, clock.judged_now()
                    waited = max(waited, now - read_at)
                answers.append(
                    encode(frame.transaction, frame.unit, self._answer(frame.unit, frame.pdu, now, waited))
                )
                if len(answers) == _AT_ONCE:
                    self.pending = True
                    break
        except FramingError as error:
            self.broken = str(error)
        self.buffer.discard(start, end)
        return b"".join(answers)

    def _answer(self, unit: int, pdu: bytes, now: float, waited: float) -> bytes:
        access = self._accesses.get(unit)
        if access is None:
            self._report_unit(unit, now)
            return exception(pdu[0], ExceptionCode.TARGET_FAILED)
        requester = replace(access.requester, waited=waited) if waited else access.requester
        access.writer_seen(requester, now)
        return execute(access.unit, requester, pdu, now)

    def cell_of(self, unit: int) -> str | None:
        """Name of the cell that answers for the unit; None if nobody does."""
        access = self._accesses.get(unit)
        return access.unit.cell.definition.name if access is not None else None

    def _report_unit(self, unit: int, now: float) -> None:
        """Nobody answers for this unit: the cells that the peer writes to hear of it, or else all that it reaches."""
        reached = {id(access): access for access in self._accesses.values()}.values()
        writing = [access for access in reached if access.requester.writer is not None]
        text = unknown_unit(unit, {access.unit.plan.unit for access in reached})
        for access in writing or reached:
            access.unit.cell.unserved(access.requester, Unserved.NO_SUCH_UNIT, text, now)


@cache
def _heads(key: int) -> tuple[bytes, ...]:
    """For every quantity, what stands between transaction id and registers in the answer to a read."""
    unit, function = key >> 8, key & 0xFF
    return tuple(
        _HEAD.pack(0, 3 + 2 * quantity, unit, function, 2 * quantity)
        for quantity in range(MAX_READ_REGISTERS + 1)
    )
