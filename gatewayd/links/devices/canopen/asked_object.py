"""Objects of a CANopen device as somebody types them, what is read there and what is written: texts and bytes. Pure."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.describe import object_text
from gatewayd.core.definition import CellDefinition
from gatewayd.links.access import AccessError, AccessProblem, PlaceRequest, PlaceValue, PlainNumber
from gatewayd.links.devices.asking import refuse_mapped
from gatewayd.links.devices.canopen.plan import TYPES, CanopenDevicePlan
from gatewayd.report.format import counted

TEXT: Final = "text"
HEX: Final = "hex"
"""Types of characters, and of bytes as they are."""
OBJECT_TYPES: Final = (*TYPES, TEXT, HEX)
_OBJECT: Final = re.compile(
    r"(?:object[: ])?(?:0x([0-9A-Fa-f]{4})|([0-9A-Fa-f]{4})h)(?::([0-9]{1,3}|[0-9A-Fa-f]{2}h))?"
)
_FIRST_OBJECT: Final = 0x1000
_MAX_SUBINDEX: Final = 0xFF
_MAX_TEXT: Final = 2000
_SIZES: Final = {1: "uint8", 2: "uint16", 4: "uint32", 8: "uint64"}
"""Length of what an object holds -> the type that a number of it has where nobody says another."""
_EXPEDITED: Final = 4
_TRUTHS: Final = {"on": True, "true": True, "1": True, "off": False, "false": False, "0": False}


@dataclass(frozen=True, slots=True)
class AskedObject:
    """An object, and how its number is made."""

    index: int
    subindex: int
    type: str = ""
    """One of `OBJECT_TYPES`; empty: by the length of what it holds."""

    @property
    def text(self) -> str:
        """`6004h:00`."""
        return object_text(self.index, self.subindex)

    def value(self, data: bytes) -> PlaceValue:
        """What it holds. Raises AccessError if that is none of the type."""
        return PlaceValue(self.text, self._value(data), data.hex())

    def _value(self, data: bytes) -> PlainNumber:
        type_name = self.type or _SIZES.get(len(data), TEXT if _is_text(data) else HEX)
        if type_name == HEX:
            return data.hex(" ")
        if type_name == TEXT:
            return data.rstrip(b"\0").decode("latin-1")
        kind = TYPES[type_name]
        size = kind.size or 0
        # An expedited answer that does not say how many of its bytes count has four.
        if len(data) < size or (len(data) > size and len(data) != _EXPEDITED):
            raise _bad(
                f"{self.text} holds {counted(len(data), 'byte')} ({data.hex(' ')}), which is no {type_name}"
            )
        return kind.unpack(data[:size])

    def content(self, text: str, former: bytes | None) -> bytes:
        """The bytes of a value that somebody has typed; `former`: what it holds, if that is known. AccessError."""
        if len(text) > _MAX_TEXT:
            raise _bad(f"a value of length {len(text)} is longer than {_MAX_TEXT}")
        type_name = self.type or _SIZES.get(len(former or b""), "")
        if not type_name:
            raise _bad(
                f"how many bytes {self.text} has nobody knows: say it with --type, {', '.join(OBJECT_TYPES)}"
            )
        if type_name == TEXT:
            return text.encode("latin-1", "replace")
        if type_name == HEX:
            try:
                return bytes.fromhex(text)
            except ValueError:
                raise _bad(f"`{text}` are no hexadecimal digits") from None
        return _packed(TYPES[type_name], type_name, text)


def object_of(request: PlaceRequest) -> AskedObject:
    """The object that somebody has typed. AccessError says what is wrong with it."""
    match = _OBJECT.fullmatch(request.place.strip())
    sub = (match[3] or "0") if match is not None else "0"
    subindex = int(sub[:-1], 16) if sub.endswith("h") else int(sub)
    if match is None or int(match[1] or match[2], 16) < _FIRST_OBJECT or subindex > _MAX_SUBINDEX:
        raise _bad(
            f"`{request.place}` is no object of a CANopen device: write 0x6004, 0x1018:4 with a sub-index, "
            "or 1018h:04h as a data sheet does"
        )
    if request.type and request.type not in OBJECT_TYPES:
        raise _bad(f"`{request.type}` is no type of an object: choose one of {', '.join(OBJECT_TYPES)}")
    if request.order:
        raise _bad("numbers on CANopen have one order: no --order")
    return AskedObject(int(match[1] or match[2], 16), subindex, request.type)


def refuse_carried(asked: AskedObject, plan: CanopenDevicePlan, cell: CellDefinition) -> None:
    """Raise AccessError where a variable has the object, or a PDO that the gateway sends would write it back."""
    at = asked.index, asked.subindex
    variables = [place.variable for place in plan.places if (place.index, place.subindex) == at]
    refuse_mapped(asked.text, variables, cell)
    for number, pdo in enumerate(plan.node.pdos):
        if not pdo.transmit and any((item.index, item.subindex) == at for item in pdo.objects):
            others = [cell.variables[place.variable].name for place in plan.places if place.pdo == number]
            raise AccessError(
                AccessProblem.MAPPED,
                f"{asked.text} is not written: the gateway sends it in PDO {pdo.number}, with {', '.join(others)}, as "
                "it was when the device was booted; map a variable to it",
            )


def _packed(kind: CanType, type_name: str, text: str) -> bytes:
    try:
        if kind is CanType.BOOLEAN:
            return kind.pack(_TRUTHS[text.lower()])
        if kind.is_real:
            return kind.pack(float(text))
        return kind.pack(int(text, 0))
    except KeyError:
        raise _bad(f"`{text}` is no value of a boolean: write on or off") from None
    except (ValueError, OverflowError, struct.error):
        raise _bad(f"`{text}` is no value of the type {type_name}") from None


def _is_text(data: bytes) -> bool:
    return bool(data) and all(0x20 <= byte < 0x7F for byte in data.rstrip(b"\0"))


def _bad(text: str) -> AccessError:
    return AccessError(AccessProblem.BAD_PLACE, text)
