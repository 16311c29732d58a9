"""The Modbus functions a unit serves: from one request PDU to one answer PDU, at one moment, without side effects
before everything that can be refused has been checked.

The order of checks is the specification's (V1.1b3, 6): function 01, quantity, byte count and length 03, address range
02, then execution. A refusal of the cell becomes the exception code of `EXCEPTION_OF`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from copy import copy

from gatewayd.core import status_layout
from gatewayd.core.admission import Change, value_for
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Value
from gatewayd.core.freshness import Source
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.unserved import Unserved
from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.links.modbus_server.registers import BitTable, RegisterImage, RegisterTable
from gatewayd.links.modbus_server.rights import Rights
from gatewayd.links.modbus_server.unserved import Places, named, unserved
from gatewayd.links.modbus_server.usual import UsualWrites
from gatewayd.links.registry import status_fields, status_tables
from gatewayd.modbus import identification
from gatewayd.modbus.areas import (
    MAX_READ_BITS,
    MAX_READ_REGISTERS,
    MAX_WRITE_BITS,
    MAX_WRITE_REGISTERS,
    MAX_WRITE_WITH_READ,
)
from gatewayd.modbus.describe import request_text, writing
from gatewayd.modbus.exceptions import ExceptionCode
from gatewayd.modbus.identification import Identification

EXCEPTION_OF = {
    Reason.NO_SUCH_ADDRESS: ExceptionCode.ILLEGAL_ADDRESS,
    Reason.NOT_WRITABLE: ExceptionCode.ILLEGAL_ADDRESS,
    Reason.HELD: ExceptionCode.BUSY,
    Reason.OUT_OF_LIMITS: ExceptionCode.ILLEGAL_VALUE,
    Reason.PARTIAL_VALUE: ExceptionCode.ILLEGAL_VALUE,
    Reason.ROBOT_LOST: ExceptionCode.TARGET_FAILED,
    Reason.CLAIMED_ELSEWHERE: ExceptionCode.PATH_UNAVAILABLE,
    Reason.HEARTBEAT_LOST: ExceptionCode.TARGET_FAILED,
    Reason.PARTIAL_TAKEOVER: ExceptionCode.ILLEGAL_VALUE,
    Reason.WAITED: ExceptionCode.BUSY,
    Reason.NOT_MEANT: ExceptionCode.BUSY,
    Reason.CONTRADICTED: ExceptionCode.ILLEGAL_VALUE,
    Reason.NOT_IN_ROLE: ExceptionCode.ILLEGAL_FUNCTION,
}


class Unit:
    """One robot cell as a Modbus unit."""

    def __init__(self, plan: ModbusPlan, cell: Cell, former: Unit | None = None) -> None:
        """`former` had its number before: what is counted of the same cell goes on."""
        self.plan = plan
        self.cell = cell
        self.image = RegisterImage(plan, cell)
        self.usual_registers = UsualWrites(cell, self.image.holding.usual)
        self.usual_coils = UsualWrites(cell, self.image.coils.usual)
        self.places = Places(plan, cell.definition)
        self.status = StatusBlock(cell, status_fields(), status_tables())
        self.identification = Identification(cell.definition.name, cell.definition.fingerprint)
        self.exception_of = {**EXCEPTION_OF, Reason.ROBOT_LOST: plan.robot_away}
        goes_on = former is not None and former.cell.definition.name == cell.definition.name
        self._ignored = [former.ignored if former is not None and goes_on else 0]
        """The one number that the unit and its limited forms count in."""
        self.rights: Rights | None = None
        """Of the role that it is limited to; None: it is not."""

    @property
    def ignored(self) -> int:
        """Registers and bits with nothing mapped that accepted writes covered."""
        return self._ignored[0]

    @ignored.setter
    def ignored(self, count: int) -> None:
        self._ignored[0] = count

    def limited(self, rights: Rights) -> Unit:
        """The same unit as a role with these rights has it: its own is only what is worked out ahead."""
        unit = copy(self)
        unit.rights = rights
        unit.usual_registers = UsualWrites(self.cell, rights.usual(self.image.holding.usual))
        unit.usual_coils = UsualWrites(self.cell, rights.usual(self.image.coils.usual))
        return unit

    def close(self) -> None:
        """Follow the cell no longer."""
        self.image.close()


Answer = bytes | ExceptionCode
_Function = Callable[[Unit, Requester, bytes, float], Answer]

_COIL_ON = 0xFF00

_WORD = struct.Struct(">H")
_TWO_WORDS = struct.Struct(">HH")
_MASK = struct.Struct(">HHH")
_WRITE_MULTIPLE = struct.Struct(">HHB")
_READ_WRITE = struct.Struct(">HHHHB")


def execute(unit: Unit, requester: Requester, pdu: bytes, now: float) -> bytes:
    """The answer to a request of `requester`."""
    if unit.rights is not None and not unit.rights.serves(pdu):
        unit.cell.unserved(requester, Unserved.NOT_IN_ROLE, request_text(pdu), now)
        return exception(pdu[0], ExceptionCode.ILLEGAL_FUNCTION)
    serve, sizes = _FUNCTIONS.get(pdu[0], (None, ()))
    answer: Answer
    if serve is None:
        answer = ExceptionCode.ILLEGAL_FUNCTION
    else:
        answer = serve(unit, requester, pdu, now) if len(pdu) in sizes else ExceptionCode.ILLEGAL_VALUE
    if not isinstance(answer, ExceptionCode):
        return answer
    found = unserved(pdu, answer, unit.places, unit.image.readable)
    if found is not None:
        unit.cell.unserved(requester, *found, now)
    return exception(pdu[0], answer)


def exception(function: int, code: ExceptionCode) -> bytes:
    """The answer that refuses a request of `function`."""
    return bytes((function | 0x80, code))


# -- reading ----------------------------------------------------------------------------------------------------------


def _read_bits(unit: Unit, table: BitTable, pdu: bytes) -> Answer:
    address, count = _TWO_WORDS.unpack_from(pdu, 1)
    if not 1 <= count <= MAX_READ_BITS:
        return ExceptionCode.ILLEGAL_VALUE
    if table.readable.reach[address] < count:
        return _unreadable(unit, table.readable.mapped[address], count)
    bits = table.read(address, count)
    return bytes((pdu[0], len(bits))) + bits


def _read_registers(unit: Unit, table: RegisterTable, pdu: bytes, now: float) -> Answer:
    address, count = _TWO_WORDS.unpack_from(pdu, 1)
    if not 1 <= count <= MAX_READ_REGISTERS:
        return ExceptionCode.ILLEGAL_VALUE
    refused = _refuse_registers(unit, table, address, count)
    if refused is not None:
        return refused
    return bytes((pdu[0], 2 * count)) + _registers(unit, table, address, count, now)


def _refuse_registers(unit: Unit, table: RegisterTable, address: int, count: int) -> ExceptionCode | None:
    """Why these registers cannot be read, if they cannot."""
    if table.readable.reach[address] >= count or status_layout.covers(address, count):
        return None
    return _unreadable(unit, table.readable.mapped[address], count)


def _unreadable(unit: Unit, mapped: int, count: int) -> ExceptionCode:
    """Mapped, but held back because the robot no longer sends; or not mapped at all."""
    return unit.plan.robot_away if mapped >= count else ExceptionCode.ILLEGAL_ADDRESS


def _registers(unit: Unit, table: RegisterTable, address: int, count: int, now: float) -> bytes:
    if address >= status_layout.BASE:
        return unit.status.read(address - status_layout.BASE, count, now)
    return bytes(table.image[2 * address : 2 * (address + count)])


# -- writing ----------------------------------------------------------------------------------------------------------


def _write_coil(unit: Unit, requester: Requester, pdu: bytes, now: float) -> Answer:
    address, value = _TWO_WORDS.unpack_from(pdu, 1)
    if value not in {0, _COIL_ON}:
        return ExceptionCode.ILLEGAL_VALUE
    return _apply_coils(unit, requester, pdu, (address, 1, bytes((value == _COIL_ON,))), now) or pdu


def _write_register(unit: Unit, requester: Requester, pdu: bytes, now: float) -> Answer:
    (address, _value) = _TWO_WORDS.unpack_from(pdu, 1)
    return _write_registers(unit, requester, pdu, (address, pdu[3:]), now) or pdu


def _write_coils(unit: Unit, requester: Requester, pdu: bytes, now: float) -> Answer:
    address, count, size = _WRITE_MULTIPLE.unpack_from(pdu, 1)
    if not 1 <= count <= MAX_WRITE_BITS or size != (count + 7) >> 3 or len(pdu) != 6 + size:
        return ExceptionCode.ILLEGAL_VALUE
    return _apply_coils(unit, requester, pdu, (address, count, pdu[6:]), now) or pdu[:5]


def _write_multiple(unit: Unit, requester: Requester, pdu: bytes, now: float) -> Answer:
    address, count, size = _WRITE_MULTIPLE.unpack_from(pdu, 1)
    if not 1 <= count <= MAX_WRITE_REGISTERS or size != 2 * count or len(pdu) != 6 + size:
        return ExceptionCode.ILLEGAL_VALUE
    return _write_registers(unit, requester, pdu, (address, pdu[6:]), now) or pdu[:5]


def _mask_write(unit: Unit, requester: Requester, pdu: bytes, now: float) -> Answer:
    address, and_mask, or_mask = _MASK.unpack_from(pdu, 1)
    if status_layout.covers(address, 1):
        present = int.from_bytes(unit.status.read(address - status_layout.BASE, 1, now), "big")
        word = (present & and_mask) | (or_mask & ~and_mask & 0xFFFF)
        return _write_status(unit, requester, address, [word], now) or pdu
    holding = unit.image.holding
    refused = _apply(unit, requester, pdu, holding.masked(address, and_mask, or_mask), now)
    if refused is None and unit.plan.ignore_gaps:
        unit.ignored += holding.ignored(address, _WORD.pack(or_mask & ~and_mask & 0xFFFF))
    return refused or pdu


def _read_write(unit: Unit, requester: Requester, pdu: bytes, now: float) -> Answer:
    first, count, address, written, size = _READ_WRITE.unpack_from(pdu, 1)
    if not (1 <= count <= MAX_READ_REGISTERS and 1 <= written <= MAX_WRITE_WITH_READ):
        return ExceptionCode.ILLEGAL_VALUE
    if size != 2 * written or len(pdu) != 10 + size:
        return ExceptionCode.ILLEGAL_VALUE
    refused = _refuse_registers(unit, unit.image.holding, first, count)
    if refused is None:
        refused = _write_registers(unit, requester, pdu, (address, pdu[10:]), now)
    if refused is not None:
        return refused
    return bytes((pdu[0], 2 * count)) + _registers(unit, unit.image.holding, first, count, now)


def _write_registers(
    unit: Unit, requester: Requester, pdu: bytes, written: tuple[int, bytes], now: float
) -> ExceptionCode | None:
    address, data = written
    count = len(data) // 2
    if unit.usual_registers.write(requester, address, count, data, now):
        return None
    if status_layout.covers(address, count):
        words = struct.unpack(f">{count}H", data)
        return _write_status(unit, requester, address, words, now)
    refused = _apply(unit, requester, pdu, unit.image.holding.changes(address, data), now)
    if refused is None:
        unit.usual_registers.accepted(address, count)
        if unit.plan.ignore_gaps:
            unit.ignored += unit.image.holding.ignored(address, data)
    return refused


def _apply_coils(
    unit: Unit, requester: Requester, pdu: bytes, written: tuple[int, int, bytes], now: float
) -> ExceptionCode | None:
    """Write so many coils from an address on; the first one is the least significant bit of the data."""
    address, count, data = written
    if unit.usual_coils.write(requester, address, count, data, now):
        return None
    packed = int.from_bytes(data, "little")
    bits = [bool(packed >> position & 1) for position in range(count)]
    refused = _apply(unit, requester, pdu, unit.image.coils.changes(address, bits), now)
    if refused is None:
        unit.usual_coils.accepted(address, count)
        if unit.plan.ignore_gaps:
            unit.ignored += unit.image.coils.ignored(address, count)
    return refused


def _write_status(
    unit: Unit, requester: Requester, address: int, words: Sequence[int], now: float
) -> ExceptionCode | None:
    first = address - status_layout.BASE
    refusal: Refusal | None
    if unit.rights is not None and unit.rights.denies_status(first, words):
        refusal = Refusal(Reason.NOT_IN_ROLE, request=f"wrote the status block at {address}")
        unit.cell.refuse(requester, refusal, now)
    else:
        refusal = unit.status.write(requester, first, words, now)
    return unit.exception_of[refusal.reason] if refusal is not None else None


def _apply(
    unit: Unit, requester: Requester, pdu: bytes, changes: list[Change] | Refusal, now: float
) -> ExceptionCode | None:
    """Hand all changes of one request to the cell at once, and every refusal of ours to its records."""
    refusal: Refusal | None
    value: Value | None = None
    denied: Refusal | None = None
    if unit.rights is not None:
        denied = unit.rights.denied(changes, unit.cell.image.values, writing(pdu))
    if denied is not None:
        value = value_for(changes, denied.variable) if not isinstance(changes, Refusal) else None
        refusal = denied
    elif isinstance(changes, Refusal):
        refusal = named(changes, pdu, unit.places)
    elif requester.writer is None:
        # A peer that may write nothing is refused even if it wrote what is there already.
        variable, value = (changes[0].variable, changes[0].value) if changes else (None, None)
        refusal = Refusal(Reason.NOT_WRITABLE, variable)
    else:
        refusal = unit.cell.write(requester, changes, now)
        return None if refusal is None else unit.exception_of[refusal.reason]
    unit.cell.refuse(requester, refusal, now, value)
    return unit.exception_of[refusal.reason]


# -- about the unit itself --------------------------------------------------------------------------------------------


def _diagnose(_unit: Unit, _requester: Requester, pdu: bytes, _now: float) -> Answer:
    """Return Query Data (V1.1b3, 6.8), which tools use as a sign of life; the others are for serial lines."""
    if pdu[1:3] != _RETURN_QUERY_DATA:
        return ExceptionCode.ILLEGAL_FUNCTION
    return pdu


def _report_server_id(unit: Unit, _requester: Requester, _pdu: bytes, _now: float) -> Answer:
    running = unit.cell.freshness.state is Source.FRESH
    return unit.identification.server_id(unit.plan.unit, running=running)


def _identify(unit: Unit, _requester: Requester, pdu: bytes, _now: float) -> Answer:
    if len(pdu) > 1 and pdu[1] != identification.MEI_TYPE:
        return ExceptionCode.ILLEGAL_FUNCTION
    answer = unit.identification.answer(pdu)
    return ExceptionCode(answer) if isinstance(answer, int) else answer


_RETURN_QUERY_DATA = bytes(2)
_TWO_WORDS_ONLY = range(5, 6)
_WITH_DATA = range(6, 254)
_FUNCTIONS: dict[int, tuple[_Function, range]] = {
    1: (lambda unit, _requester, pdu, _now: _read_bits(unit, unit.image.coils, pdu), _TWO_WORDS_ONLY),
    2: (lambda unit, _requester, pdu, _now: _read_bits(unit, unit.image.discrete, pdu), _TWO_WORDS_ONLY),
    3: (lambda unit, _, pdu, now: _read_registers(unit, unit.image.holding, pdu, now), _TWO_WORDS_ONLY),
    4: (lambda unit, _, pdu, now: _read_registers(unit, unit.image.input, pdu, now), _TWO_WORDS_ONLY),
    5: (_write_coil, _TWO_WORDS_ONLY),
    6: (_write_register, _TWO_WORDS_ONLY),
    8: (_diagnose, range(3, 254, 2)),
    15: (_write_coils, _WITH_DATA),
    16: (_write_multiple, _WITH_DATA),
    17: (_report_server_id, range(1, 2)),
    22: (_mask_write, range(7, 8)),
    23: (_read_write, range(10, 254)),
    identification.FUNCTION: (_identify, range(1, 254)),
}
"""What serves a function, and how many bytes its requests may have; whether the data is whole is for it to check."""
