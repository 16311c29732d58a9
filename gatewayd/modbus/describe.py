"""Modbus in words: what a request asks for, what is wrong with it, what an answer says (Application Protocol V1.1b3).

Pure, and total: any bytes have a description.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

from gatewayd.modbus.areas import (
    AREA_NAMES,
    MAX_READ_BITS,
    MAX_READ_REGISTERS,
    MAX_WRITE_BITS,
    MAX_WRITE_REGISTERS,
    MAX_WRITE_WITH_READ,
    Area,
)
from gatewayd.modbus.exceptions import NAMES

_SHOWN = 16
"""Values in one line."""
_WORD = struct.Struct(">H")
_EXCEPTION = 0x80
_COIL_ON = 0xFF00

_READS = {1: Area.COIL, 2: Area.DISCRETE, 3: Area.HOLDING, 4: Area.INPUT}
_SINGLE_WRITES = {5: Area.COIL, 6: Area.HOLDING, 22: Area.HOLDING}
_MULTIPLE_WRITES = {15: Area.COIL, 16: Area.HOLDING}
_MOST_WRITTEN = {15: MAX_WRITE_BITS, 16: MAX_WRITE_REGISTERS, 23: MAX_WRITE_WITH_READ}
_READ_WRITE = 23
_FIXED = {1: 5, 2: 5, 3: 5, 4: 5, 5: 5, 6: 5, 22: 7}
"""Bytes of requests that have always as many."""

FUNCTIONS = {
    1: "read coils",
    2: "read discrete inputs",
    3: "read holding registers",
    4: "read input registers",
    5: "write coil",
    6: "write register",
    7: "read exception status",
    8: "diagnostics",
    11: "get comm event counter",
    12: "get comm event log",
    15: "write coils",
    16: "write registers",
    17: "report server id",
    20: "read file record",
    21: "write file record",
    22: "mask write register",
    23: "read and write registers",
    24: "read FIFO queue",
    43: "encapsulated interface",
}
"""Names of public function codes."""


class Span(NamedTuple):
    """Addresses of one area."""

    area: Area
    first: int
    quantity: int

    def __str__(self) -> str:
        """`holding 100`, `holding 101-102`."""
        last = self.first + self.quantity - 1
        return f"{AREA_NAMES[self.area]} {self.first}" + (f"-{last}" if self.quantity > 1 else "")


def reading(pdu: bytes) -> Span | None:
    """What a request reads; None if it reads nothing, or is not whole."""
    area = Area.HOLDING if _function(pdu) == _READ_WRITE else _READS.get(_function(pdu))
    return None if area is None or len(pdu) < 5 else Span(area, _word(pdu, 1), _word(pdu, 3))


def writing(pdu: bytes) -> Span | None:
    """What a request writes; None if it writes nothing, or is not whole."""
    function = _function(pdu)
    if function in _SINGLE_WRITES and len(pdu) >= 5:
        return Span(_SINGLE_WRITES[function], _word(pdu, 1), 1)
    if function in _MULTIPLE_WRITES and len(pdu) >= 5:
        return Span(_MULTIPLE_WRITES[function], _word(pdu, 1), _word(pdu, 3))
    if function == _READ_WRITE and len(pdu) >= 9:
        return Span(Area.HOLDING, _word(pdu, 5), _word(pdu, 7))
    return None


def fault(pdu: bytes) -> str:
    """What is wrong with the quantity or length of a request, in words; empty if nothing is."""
    function, read, written = _function(pdu), reading(pdu), writing(pdu)
    if read is not None:
        most = MAX_READ_BITS if read.area.of_bits else MAX_READ_REGISTERS
        if not 1 <= read.quantity <= most:
            return f"quantity {read.quantity} is not within 1 to {most}"
    if function in _MOST_WRITTEN and written is not None:
        most = _MOST_WRITTEN[function]
        if not 1 <= written.quantity <= most:
            return f"quantity {written.quantity} is not within 1 to {most}"
        head = 10 if function == _READ_WRITE else 6
        size = (written.quantity + 7) >> 3 if written.area.of_bits else 2 * written.quantity
        if len(pdu) < head or pdu[head - 1] != size or len(pdu) != head + size:
            return f"its data does not fit quantity {written.quantity}, which needs length {size}"
    elif function in _MOST_WRITTEN:
        return f"too short, length {len(pdu)}"
    if function in _FIXED and len(pdu) != _FIXED[function]:
        return f"length {len(pdu)} instead of {_FIXED[function]}"
    if function == 5 and _word(pdu, 3) not in (0, _COIL_ON):
        return f"a coil is written with 0 or FF00h, not with {_word(pdu, 3):04X}h"
    return ""


def function_text(pdu: bytes) -> str:
    """`function 8 (diagnostics)`."""
    function = _function(pdu)
    name = FUNCTIONS.get(function)
    return f"function {function}" + (f" ({name})" if name else "")


def request_text(pdu: bytes) -> str:
    """A request: `read holding 100-103`, `write holding 10 = 7`."""
    function, wrong = _function(pdu), fault(pdu)
    read, written = reading(pdu), writing(pdu)
    if wrong or (read is None and written is None):
        return function_text(pdu) + (f": {wrong}" if wrong else _data(pdu[1:]))
    if written is None:
        return f"read {read}"
    if function == 22:
        return f"write {written} with masks AND {_word(pdu, 3):04X}h, OR {_word(pdu, 5):04X}h"
    text = f"write {written} = {_values(_written(pdu, written))}"
    return text if read is None else f"read {read}, {text}"


def answer_text(pdu: bytes, request: bytes | None = None) -> str:
    """An answer; with the `request` that it belongs to it is known what its values are."""
    function = _function(pdu)
    if function & _EXCEPTION:
        code = pdu[1] if len(pdu) > 1 else 0
        name = NAMES.get(code, "exception")
        return f"refused with {code:02X}h {name}: {function_text(bytes([function & ~_EXCEPTION]))}"
    read = reading(request) if request is not None and _function(request) == function else None
    if read is not None and len(pdu) > 1 and len(pdu) == 2 + pdu[1]:
        return f"{read} = {_values(_read(pdu, read))}"
    written = writing(pdu) if function != _READ_WRITE else None
    if written is not None:
        return f"written {written}"
    return function_text(pdu) + _data(pdu[1:])


def _function(pdu: bytes) -> int:
    return pdu[0] if pdu else 0


def _word(pdu: bytes, position: int) -> int:
    number: int = _WORD.unpack_from(pdu, position)[0]
    return number


def _written(pdu: bytes, span: Span) -> Sequence[int]:
    function = pdu[0]
    if function == 5:
        return [int(_word(pdu, 3) == _COIL_ON)]
    if function == 6:
        return [_word(pdu, 3)]
    return _unpacked(pdu[10 if function == _READ_WRITE else 6 :], span)


def _read(pdu: bytes, span: Span) -> Sequence[int]:
    return _unpacked(pdu[2:], span)


def _unpacked(data: bytes, span: Span) -> Sequence[int]:
    """As many values as there are and as may be shown, and one more."""
    if span.area.of_bits:
        count = min(span.quantity, 8 * len(data), _SHOWN + 1)
        return [data[position >> 3] >> (position & 7) & 1 for position in range(count)]
    return [word for (word,) in _WORD.iter_unpack(data[: 2 * min(len(data) // 2, _SHOWN + 1)])]


def _values(values: Sequence[int]) -> str:
    return " ".join(map(str, values[:_SHOWN])) + (" ..." if len(values) > _SHOWN else "")


def _data(data: bytes) -> str:
    return f": {data[:_SHOWN].hex(' ')}" + (" ..." if len(data) > _SHOWN else "") if data else ""
