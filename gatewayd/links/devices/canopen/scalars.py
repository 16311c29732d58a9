"""The small language of CANopen devices in a mapping: indices of objects, numbers of PDOs, identities."""

from __future__ import annotations

import re
from typing import Annotated, Final, Literal

from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import refuse, scalar
from gatewayd.mapping.typed import BeforeValidator, Field

_HEXADECIMAL = re.compile(r"0x[0-9A-Fa-f]{1,8}")
_DECIMAL = re.compile(r"0|[1-9][0-9]{0,9}")
_FIRST_OBJECT: Final = 0x1000
_LAST_OBJECT: Final = 0xFFFF
_MAX_WORD: Final = 0xFFFF_FFFF
_MAX_PDO: Final = 512
NO_PDO: Final = "none"
"""Stands for SDO: no PDO has the object."""


def _object_index(value: object) -> int:
    hint = "write an index in hexadecimal digits, for example 0x6004"
    text = scalar(value, "the index of an object", hint)
    if not _HEXADECIMAL.fullmatch(text):
        if text.isascii() and text.isdigit() and len(text) == 4:
            hint = f"indices are hexadecimal: 0x{text}"
        refuse(syntax.BAD_NUMBER, f"`{text}` is not the index of an object", hint)
    number = int(text, 16)
    if not _FIRST_OBJECT <= number <= _LAST_OBJECT:
        refuse(syntax.OUT_OF_RANGE, f"the index {text} is not between 0x1000 and 0xFFFF", hint)
    return number


ObjectIndex = Annotated[
    int,
    BeforeValidator(
        _object_index,
        # An editor that knows YAML takes 0x6004 for a number.
        json_schema_input_type=int | Annotated[str, Field(pattern="^0x[0-9A-Fa-f]{4}$", examples=["0x6004"])],
    ),
]
"""Index of an object: 0x1000 to 0xFFFF."""


def _identity(value: object) -> int:
    hint = "write a number of 32 bits: 1, or 0x00010002"
    text = scalar(value, "a number of 32 bits", hint)
    if _HEXADECIMAL.fullmatch(text):
        return int(text, 16)
    if not _DECIMAL.fullmatch(text):
        refuse(syntax.BAD_NUMBER, f"`{text}` is not a number of 32 bits", hint)
    if int(text) > _MAX_WORD:
        refuse(syntax.OUT_OF_RANGE, f"{text} has more than 32 bits", hint)
    return int(text)


IdentityNumber = Annotated[
    int,
    BeforeValidator(
        _identity,
        json_schema_input_type=int
        | Annotated[str, Field(pattern="^0x[0-9A-Fa-f]{1,8}$", examples=["0x00010002"])],
    ),
]
"""A number of 32 bits in 1018h."""


def _pdo_number(value: object) -> object:
    hint = "write the number of a PDO of the device, for example 1, or none for SDO"
    text = scalar(value, "the number of a PDO", hint)
    if text == NO_PDO:
        return NO_PDO
    if not _DECIMAL.fullmatch(text) or not 1 <= int(text) <= _MAX_PDO:
        refuse(syntax.OUT_OF_RANGE, f"`{text}` is not the number of a PDO", hint)
    return int(text)


PdoNumber = Annotated[
    int | Literal["none"],
    BeforeValidator(
        _pdo_number, json_schema_input_type=Annotated[int, Field(ge=1, le=_MAX_PDO)] | Literal["none"]
    ),
]
"""Which PDO of the device, from 1; or none."""
