"""Places in a Modbus device as somebody types them, what is read there, and what is written: texts and bytes. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from gatewayd.core.definition import Value, ValueKind
from gatewayd.links.access import AccessError, AccessProblem, PlaceRequest, PlaceValue
from gatewayd.links.devices.modbus.plan import DevicePlacement
from gatewayd.modbus.areas import (
    AREA_NAMES,
    MAX_READ_BITS,
    MAX_READ_REGISTERS,
    MAX_WRITE_BITS,
    MAX_WRITE_REGISTERS,
    Area,
)
from gatewayd.modbus.client.requests import (
    ModbusRequest,
    read_write,
    write_coil,
    write_coils,
    write_register,
    write_registers,
)
from gatewayd.modbus.codec import ORDERS, TYPES, NumberFormat, make_codec
from gatewayd.report.format import counted

TEXT: Final = "text"
"""The type of characters, two in each register."""
NUMBER_TYPES: Final = (*(name for name, its in TYPES.items() if not its.is_byte and name != "bool"), TEXT)
"""Types of values in registers."""
_DEFAULT_TYPE: Final = "uint16"
_PLACE: Final = re.compile(
    r"(?:(coil|discrete|input|holding)[: ])?\s*([0-9]{1,5})(?:\.\.([0-9]{1,5}))?", re.IGNORECASE
)
_MAX_ADDRESS: Final = 0xFFFF
_TRUTHS: Final = {"on": True, "true": True, "1": True, "off": False, "false": False, "0": False}
_MAX_TEXT: Final = 2000
"""Characters of what is to be written."""


@dataclass(frozen=True, slots=True)
class AskedPlace:
    """Some addresses of one area, and how numbers lie there."""

    area: Area
    address: int
    count: int
    type: str = _DEFAULT_TYPE
    """Of registers; one of `NUMBER_TYPES`."""
    order: str = "ABCD"

    @property
    def addresses(self) -> range:
        """All of them."""
        return range(self.address, self.address + self.count)

    @property
    def text(self) -> str:
        """`holding 100..103`."""
        return _words(self.area, self.address, self.count)

    @property
    def words(self) -> int:
        """Registers of one value; 1 of coils and inputs, all of a text."""
        if self.area.of_bits:
            return 1
        return self.count if self.type == TEXT else TYPES[self.type].words

    def mapped(self, placements: Iterable[DevicePlacement]) -> list[int]:
        """The variables that lie in any of these addresses."""
        own = self.addresses
        return [
            placed.variable
            for placed in placements
            if placed.area is self.area
            and placed.addresses.start < own.stop
            and own.start < placed.addresses.stop
        ]

    def values(self, data: bytes) -> tuple[PlaceValue, ...]:
        """What an answer says; `data`: as `modbus.client.requests.read` describes it."""
        if self.area.of_bits:
            return tuple(
                PlaceValue(_words(self.area, self.address + bit, 1), bool(data[bit // 8] >> bit % 8 & 1), "")
                for bit in range(self.count)
            )
        size = 2 * self.words
        return tuple(
            PlaceValue(
                _words(self.area, self.address + at // 2, self.words),
                self._number(data[at : at + size]),
                data[at : at + size].hex(),
            )
            for at in range(0, 2 * self.count, size)
        )

    def requests(self, data: bytes, bits: tuple[bool, ...], write: str) -> Sequence[ModbusRequest]:
        """What writes these registers or coils; `write`: with which functions (`ModbusDevicePlan.write`)."""
        if self.area is Area.COIL:
            if write == "multiple" or (write != "single" and len(bits) > 1):
                return (write_coils(self.address, bits),)
            return [write_coil(self.address + number, on) for number, on in enumerate(bits)]
        if write == "read_write":
            return (read_write(self.address, self.count, self.address, data),)
        if write == "single" or (write == "auto" and self.count == 1):
            return [
                write_register(self.address + number, data[2 * number : 2 * number + 2])
                for number in range(self.count)
            ]
        return (write_registers(self.address, data),)

    def _number(self, data: bytes) -> Value | str:
        if self.type == TEXT:
            return data.rstrip(b"\0 ").decode("ascii", "replace")
        value = make_codec(self.type, self.order, kind=_kind(TYPES[self.type])).decode(data)
        return "nan" if value is None else value


def place_of(request: PlaceRequest) -> AskedPlace:
    """The place that somebody has typed. AccessError says what is wrong with it."""
    match = _PLACE.fullmatch(request.place.strip())
    if match is None:
        raise _bad(
            f"`{request.place}` is no place in a Modbus device: write holding:100, holding:100..109, "
            "input:4, coil:0..15 or discrete:3; a number alone is a holding register"
        )
    area = _AREAS[(match[1] or "holding").lower()]
    type_name, order = _form(area, request)
    first = int(match[2])
    each = 1 if area.of_bits or type_name == TEXT else TYPES[type_name].words
    last = int(match[3]) if match[3] is not None else first + each - 1
    count = last - first + 1
    most = MAX_READ_BITS if area.of_bits else MAX_READ_REGISTERS
    if not first <= last <= _MAX_ADDRESS or count > most:
        raise _bad(f"{match[0]} is more than one request can read ({most}), or not within 0..{_MAX_ADDRESS}")
    if count % each:
        raise _bad(
            f"{match[0]} is {counted(count, 'register')}, of which {type_name} takes {each} each: "
            f"name {each} or a multiple of it"
        )
    return AskedPlace(area, first, count, type_name, order)


_AREAS: Final = {name: area for area, name in AREA_NAMES.items()}


def content_of(place: AskedPlace, text: str) -> tuple[bytes, tuple[bool, ...]]:
    """The registers or coils of a value that somebody has typed; several are separated by commas. Raises AccessError.

    Nothing saturates: what the place cannot hold exactly in its range is refused.
    """
    if place.area not in (Area.COIL, Area.HOLDING):
        raise _bad(f"{place.text} cannot be written: a device has only coils and holding registers for that")
    if len(text) > _MAX_TEXT:
        raise _bad(f"a value of length {len(text)} is longer than {_MAX_TEXT}")
    most = MAX_WRITE_BITS if place.area.of_bits else MAX_WRITE_REGISTERS
    if place.count > most:
        raise _bad(f"{place.text} are more than the {most} that one request can write")
    if place.type == TEXT and not place.area.of_bits:
        return _characters(place, text), ()
    parts = [part.strip() for part in text.split(",")]
    wanted = place.count // place.words
    if len(parts) != wanted:
        raise _bad(f"{place.text} takes {counted(wanted, 'value')}, separated by commas; found {len(parts)}")
    if place.area.of_bits:
        return b"", tuple(_truth(part) for part in parts)
    return b"".join(_encoded(place, part) for part in parts), ()


def _form(area: Area, request: PlaceRequest) -> tuple[str, str]:
    type_name = request.type or _DEFAULT_TYPE
    order = (request.order or "ABCD").upper()
    if area.of_bits and (request.type or request.order):
        raise _bad(f"a {AREA_NAMES[area]} is one bit: it has no type and no order")
    if type_name not in NUMBER_TYPES:
        raise _bad(f"`{request.type}` is no type of registers: choose one of {', '.join(NUMBER_TYPES)}")
    if order not in ORDERS:
        raise _bad(f"`{request.order}` is no order: choose one of {', '.join(ORDERS)}")
    return type_name, order


def _truth(text: str) -> bool:
    found = _TRUTHS.get(text.lower())
    if found is None:
        raise _bad(f"`{text}` is no value of a coil: write on or off")
    return found


def _encoded(place: AskedPlace, text: str) -> bytes:
    number = TYPES[place.type]
    value: float
    try:
        value = float(text) if number.is_real else int(text, 0)
    except ValueError:
        what = "a number" if number.is_real else "a whole number"
        raise _bad(f"`{text}` is not {what}, as {number.name} needs it") from None
    if not number.low <= value <= number.high:
        raise _bad(f"{text} is not within {number.low:g}..{number.high:g}, the range of {number.name}")
    return make_codec(number.name, place.order, kind=_kind(number)).encode(value)


def _characters(place: AskedPlace, text: str) -> bytes:
    data = text.encode("ascii", "replace")
    if not text.isascii() or len(data) > 2 * place.count:
        raise _bad(f"{place.text} holds {counted(2 * place.count, 'character')} of ASCII")
    return data.ljust(2 * place.count, b"\0")


def _kind(number: NumberFormat) -> ValueKind:
    return ValueKind.FLOAT if number.is_real else ValueKind.INT


def _words(area: Area, address: int, count: int) -> str:
    last = f"..{address + count - 1}" if count > 1 else ""
    return f"{AREA_NAMES[area]} {address}{last}"


def _bad(text: str) -> AccessError:
    return AccessError(AccessProblem.BAD_PLACE, text)
