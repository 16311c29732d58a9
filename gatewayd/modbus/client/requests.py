"""Requests of a client, and what their answers say (Application Protocol V1.1b3, 6 and 7), without input and output.

Registers are bytes here, two for each, high byte first; bits are bytes too, the first bit in the lowest of the first
byte (6.1). So nothing is converted before the codec that knows the types.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from gatewayd.modbus.areas import MAX_WRITE_BITS, MAX_WRITE_REGISTERS, MAX_WRITE_WITH_READ, Area
from gatewayd.modbus.client import pdus
from gatewayd.modbus.exceptions import NAMES, ExceptionCode

_ERROR_BIT = 0x80
_MAX_ADDRESS = 0xFFFF
_MAX_OBJECT_ID = 0xFF
_ACKNOWLEDGE = 5
_NO_PATH = (ExceptionCode.PATH_UNAVAILABLE, ExceptionCode.TARGET_FAILED)


class FunctionCode(IntEnum):
    """Those that the client uses."""

    READ_COILS = 1
    READ_DISCRETE = 2
    READ_HOLDING = 3
    READ_INPUT = 4
    WRITE_COIL = 5
    WRITE_REGISTER = 6
    WRITE_COILS = 15
    WRITE_REGISTERS = 16
    MASK_WRITE_REGISTER = 22
    READ_WRITE_REGISTERS = 23
    ENCAPSULATED = 43


_READING = {
    Area.COIL: FunctionCode.READ_COILS,
    Area.DISCRETE: FunctionCode.READ_DISCRETE,
    Area.HOLDING: FunctionCode.READ_HOLDING,
    Area.INPUT: FunctionCode.READ_INPUT,
}


@dataclass(frozen=True, slots=True)
class ModbusRequest:
    """A request PDU, and what a good answer to it looks like. Made by the functions below."""

    pdu: bytes
    answer_size: int
    """Bytes of the PDU of a good answer; 0: it says so itself (FC 43)."""
    head: bytes = field(repr=False)
    """What a good answer begins with: for a write that is all of it, the echo."""
    is_write: bool = False

    @property
    def function(self) -> int:
        """Function code."""
        return self.pdu[0]


@dataclass(frozen=True, slots=True)
class ExceptionAnswer:
    """The unit, or a gateway before it, refuses (V1.1b3, 7)."""

    code: int

    @property
    def text(self) -> str:
        """As in `exception 02 (illegal data address)`."""
        return f"exception {self.code:02X} ({NAMES.get(self.code, 'unknown')})"

    @property
    def is_no_answer(self) -> bool:
        """Whether a gateway says that the unit behind it does not answer (0A, 0B)."""
        return self.code in _NO_PATH

    @property
    def is_refusal(self) -> bool:
        """Whether the unit will say the same again: it is neither away nor busy."""
        return self.code not in (*_NO_PATH, _ACKNOWLEDGE, ExceptionCode.BUSY)


@dataclass(frozen=True, slots=True)
class TimedOut:
    """Nothing has come in time."""

    after: float
    """Seconds."""

    @property
    def text(self) -> str:
        """As in `no answer within 0.3 s`."""
        return f"no answer within {self.after:g} s"


@dataclass(frozen=True, slots=True)
class BadAnswer:
    """What came is no answer to the request: another length, another echo, another function, or no frame at all."""

    text: str


@dataclass(frozen=True, slots=True)
class ConnectionLost:
    """The connection ended before the answer came."""

    text: str


Failure = ExceptionAnswer | TimedOut | BadAnswer | ConnectionLost
"""Why a request has no result; each has its `text`."""


def read(area: Area, address: int, count: int) -> ModbusRequest:
    """FC 1 to 4: `count` bits (1..2000) or registers (1..125) from `address` on.

    Its data: bits as bytes, unused ones of the last byte 0 or not, as the unit likes; or registers as 2 bytes each.
    """
    function = _READING[area]
    _check_range(address, count)
    size = (count + 7) // 8 if area.of_bits else 2 * count
    return ModbusRequest(pdus.read(function, address, count), 2 + size, bytes((function, size)))


def write_coil(address: int, on: bool) -> ModbusRequest:
    """FC 5."""
    _check_range(address, 1)
    return _echoed(pdus.write_coil(address, on))


def write_register(address: int, data: bytes) -> ModbusRequest:
    """FC 6: one register, 2 bytes, high byte first."""
    _check_range(address, 1)
    _check_registers(data, 1)
    return _echoed(pdus.write_register(address, data))


def write_coils(address: int, bits: tuple[bool, ...]) -> ModbusRequest:
    """FC 15: 1 to 1968 coils from `address` on."""
    _check_range(address, len(bits))
    if len(bits) > MAX_WRITE_BITS:
        raise ValueError(f"{len(bits)} coils are more than the {MAX_WRITE_BITS} of one request")
    return _echoed(pdus.write_coils(address, bits), 5)


def write_registers(address: int, data: bytes) -> ModbusRequest:
    """FC 16: 1 to 123 registers from `address` on, 2 bytes each, high byte first."""
    _check_range(address, len(data) // 2)
    _check_registers(data, MAX_WRITE_REGISTERS)
    return _echoed(pdus.write_registers(address, data), 5)


def mask_register(address: int, and_mask: int, or_mask: int) -> ModbusRequest:
    """FC 22: the register becomes (register AND and_mask) OR (or_mask AND NOT and_mask) (V1.1b3, 6.16)."""
    _check_range(address, 1)
    return _echoed(pdus.mask_register(address, and_mask, or_mask))


def read_write(read_address: int, count: int, write_address: int, data: bytes) -> ModbusRequest:
    """FC 23: write up to 121 registers, then read 1 to 125; its data are those that were read."""
    _check_range(read_address, count)
    _check_range(write_address, len(data) // 2)
    _check_registers(data, MAX_WRITE_WITH_READ)
    head = bytes((FunctionCode.READ_WRITE_REGISTERS, 2 * count))
    pdu = pdus.read_write(read_address, count, write_address, data)
    return ModbusRequest(pdu, 2 + 2 * count, head, is_write=True)


def read_identification(object_id: int = 0, code: int = 1) -> ModbusRequest:
    """FC 43 with MEI type 14: the identification objects from `object_id` on; `code` 1 basic, 2 regular, 3 extended."""
    if not 0 <= object_id <= _MAX_OBJECT_ID:
        raise ValueError(f"object id {object_id} is not within 0..{_MAX_OBJECT_ID}")
    pdu = pdus.read_identification(code, object_id)
    return ModbusRequest(pdu, 0, pdu[:2])


def parse_answer(request: ModbusRequest, pdu: bytes) -> bytes | Failure:
    """The data of the answer, empty for a write; or why there are none. Never raises, whatever the bytes are."""
    if not pdu:
        return BadAnswer("an empty answer")
    function = request.pdu[0]
    if pdu[0] != function:
        return _parse_exception(function, pdu)
    if len(pdu) != request.answer_size and request.answer_size:
        return BadAnswer(f"an answer of length {len(pdu)} instead of {request.answer_size}")
    head = request.head
    if not pdu.startswith(head):
        return BadAnswer(f"an answer that begins with {pdu[: len(head)].hex()} instead of {head.hex()}")
    return pdu[len(head) :]


def _parse_exception(function: int, pdu: bytes) -> Failure:
    if pdu[0] != function | _ERROR_BIT:
        return BadAnswer(f"an answer to function {pdu[0] & ~_ERROR_BIT} instead of {function}")
    if len(pdu) != 2:
        return BadAnswer(f"an exception of length {len(pdu)} instead of 2")
    return ExceptionAnswer(pdu[1])


def _echoed(pdu: bytes, size: int | None = None) -> ModbusRequest:
    """A write whose answer is the beginning of its request."""
    echo = pdu[:size]
    return ModbusRequest(pdu, len(echo), echo, is_write=True)


def _check_range(address: int, count: int) -> None:
    if count < 1:
        raise ValueError(f"a request for {count} instead of 1 at least")
    if not 0 <= address <= address + count - 1 <= _MAX_ADDRESS:
        raise ValueError(f"addresses {address} to {address + count - 1} are not within 0..{_MAX_ADDRESS}")


def _check_registers(data: bytes, most: int) -> None:
    if len(data) % 2 or not 1 <= len(data) // 2 <= most:
        raise ValueError(f"registers of length {len(data)} instead of 2 to {2 * most}, even")
