"""Frames of a client: Modbus TCP (Messaging Guide V1.0b, 3.1.3) and RTU (Serial Line V1.02, 2.5.1). Pure.

Whatever comes in, what is kept of it is bounded: by one frame on TCP, by MAX_NOISE bytes on a serial line.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from gatewayd.modbus.client import pdus
from gatewayd.modbus.client.requests import ModbusRequest
from gatewayd.modbus.frames import HEADER_SIZE, FramingError, encode, split

RTU_OVERHEAD = 3
"""Bytes around the PDU: address and check."""
MAX_RTU_FRAME = 256
MAX_NOISE = 2 * MAX_RTU_FRAME
"""Bytes that may come in for one request on a serial line before what comes counts as garbage."""

_ERROR_BIT = 0x80
_EXCEPTION_SIZE = 2 + RTU_OVERHEAD
_TRANSACTIONS = 0x10000


class AnswerFrame(NamedTuple):
    """An answer as it came in."""

    transaction: int
    """As the request's; 0 on a serial line."""
    unit: int
    pdu: bytes


class TcpFraming:
    """Both directions of one TCP connection."""

    __slots__ = ("_buffer", "_transaction")

    def __init__(self, transaction: int = 0) -> None:
        """`transaction` is the id before the first."""
        self._transaction = transaction
        self._buffer = bytearray()

    @property
    def is_within_frame(self) -> bool:
        """Whether a frame has begun to come in and not ended."""
        return bool(self._buffer)

    @property
    def front(self) -> tuple[int, int] | None:
        """Transaction and unit of what has begun to come in, as far as they are right; None: too little has."""
        buffer = self._buffer
        return (buffer[0] << 8 | buffer[1], buffer[6]) if len(buffer) >= HEADER_SIZE else None

    def request(self, unit: int, pdu: bytes) -> tuple[int, bytes]:
        """The transaction id of a request, and its frame. An id comes again after 65,536 requests."""
        self._transaction = transaction = (self._transaction + 1) % _TRANSACTIONS
        return transaction, encode(transaction, unit, pdu)

    def feed(self, data: bytes) -> Iterator[AnswerFrame]:
        """The frames that are complete now. FramingError where none can begin: the connection is of no use any more."""
        buffer = self._buffer
        buffer += data
        start, end = 0, len(buffer)
        try:
            while (frame := split(buffer, start, end)) is not None:
                start = frame.end
                yield AnswerFrame(frame.transaction, frame.unit, frame.pdu)
        finally:
            del buffer[:start]


class RtuFraming:
    """Both directions of a serial line, or of a TCP connection that is one. There is one request at a time.

    The request says how long its answer is, so that no silence has to be measured to find its end, which neither USB
    adapters nor a loop could. Noise before the answer is skipped.
    """

    __slots__ = ("_buffer", "_request", "_start", "_unit", "noise")

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._start = 0
        self._unit = 0
        self._request: ModbusRequest | None = None
        self.noise = 0
        """Bytes that came in and belong to no answer, in all."""

    @property
    def is_within_frame(self) -> bool:
        """Whether something has come in for the request that is no whole answer."""
        return bool(self._buffer)

    def request(self, unit: int, request: ModbusRequest) -> bytes:
        """The frame of a request; from now on its answer is looked for."""
        self.reset()
        self._unit, self._request = unit, request
        frame = bytes((unit,)) + request.pdu
        return frame + pdus.crc(frame)

    def reset(self) -> None:
        """Forget the request and what has come in."""
        self.noise += len(self._buffer)
        self._buffer.clear()
        self._start = 0
        self._request = None

    def feed(self, data: bytes) -> AnswerFrame | None:
        """The answer, once it is complete. FramingError once too much has come in that is none."""
        request = self._request
        if request is None:
            self.noise += len(data)
            return None
        buffer = self._buffer
        buffer += data[: MAX_NOISE + 1 - len(buffer)]
        frame = self._find(request)
        if frame is not None:
            self.noise += len(buffer) - len(frame.pdu) - RTU_OVERHEAD
            self._request = None
            buffer.clear()
            self._start = 0
        elif len(buffer) > MAX_NOISE:
            raise FramingError(f"more than {MAX_NOISE} bytes without an answer in them")
        return frame

    def _find(self, request: ModbusRequest) -> AnswerFrame | None:
        """The first whole answer with a right check. Where none can begin is not looked at again."""
        buffer, unit, function = self._buffer, self._unit, request.function
        first_open = None
        for start in range(self._start, len(buffer)):
            if buffer[start] != unit:
                continue
            size = self._size(request, function, start)
            if size > len(buffer) - start:
                first_open = start if first_open is None else first_open
            elif (
                size and pdus.crc(buffer[start : start + size - 2]) == buffer[start + size - 2 : start + size]
            ):
                return AnswerFrame(0, unit, bytes(buffer[start + 1 : start + size - 2]))
        self._start = len(buffer) if first_open is None else first_open
        return None

    def _size(self, request: ModbusRequest, function: int, start: int) -> int:
        """Bytes of the answer that may begin there; 0: none does; more than there are: nobody knows yet."""
        buffer = self._buffer
        if start + 1 == len(buffer):
            return 2
        if buffer[start + 1] == function | _ERROR_BIT:
            return _EXCEPTION_SIZE
        if buffer[start + 1] != function:
            return 0
        if request.answer_size:
            return request.answer_size + RTU_OVERHEAD
        size = pdus.identification_frame_size(buffer[start : start + MAX_RTU_FRAME])
        return 0 if size > MAX_RTU_FRAME <= len(buffer) - start else size


__all__ = ["HEADER_SIZE", "AnswerFrame", "FramingError", "RtuFraming", "TcpFraming"]
