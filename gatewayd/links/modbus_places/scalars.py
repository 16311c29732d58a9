"""The small language of the Modbus part of a mapping: addresses.

As `gatewayd.mapping.scalars`: what cannot be read raises `ValueRefused` with the rule that it breaks.
"""

from __future__ import annotations

import re
from typing import Annotated, Final, Literal

from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import declare
from gatewayd.mapping.scalars import refuse, scalar
from gatewayd.mapping.typed import BeforeValidator, Field

BAD_ADDRESS = declare(
    "GW115", "bad-address", "a Modbus address that cannot be read", home="gatewayd.links.modbus_places.rules"
)
Half = Literal["high", "low"]
"""A byte of a register. The high one comes first on the wire."""
Part = int | Half | None
"""Bit or byte of a register; None: all of it."""

_ADDRESS = re.compile(r"(0|[1-9][0-9]*|0[xX][0-9A-Fa-f]+)(?:\.(?:(0|[1-9][0-9]*)|(high|low)))?")
_MAX_ADDRESS: Final = 0xFFFF
_MAX_BIT: Final = 15


def _address(value: object) -> tuple[int, Part]:
    if isinstance(value, tuple):
        return value
    hint = "write a register (100, 0x64), a bit (100.3) or a byte of it (100.high, 100.low), counted from 0"
    text = scalar(value, "an address", hint)
    match = _ADDRESS.fullmatch(text)
    if match is None:
        refuse(BAD_ADDRESS, f"`{text}` is not an address", hint)
    address = int(match[1], 0)
    if address > _MAX_ADDRESS:
        refuse(
            syntax.OUT_OF_RANGE,
            f"the address {address} is greater than 65535",
            _notation_hint(match[1]) or hint,
        )
    half: Half | None = "high" if match[3] == "high" else "low" if match[3] == "low" else None
    bit = int(match[2]) if match[2] is not None else None
    if bit is not None and bit > _MAX_BIT:
        hint = "bit 0 is the least significant of the register, bit 15 the most"
        refuse(syntax.OUT_OF_RANGE, f"the register has no bit {bit}", hint)
    return address, half or bit


def _notation_hint(digits: str) -> str | None:
    """Explain 400101 and the like, without guessing."""
    areas = {"0": "coil", "1": "discrete", "3": "input", "4": "holding"}
    if len(digits) != 6 or digits[0] not in areas or int(digits[1:]) == 0:
        return None
    return f"addresses count from 0: where a manual says {digits}, write {{{areas[digits[0]]}: {int(digits[1:]) - 1}}}"


Address = Annotated[
    tuple[int, Part],
    BeforeValidator(
        _address,
        json_schema_input_type=float
        | Annotated[str, Field(pattern=r"^([0-9]{1,5}|0[xX][0-9A-Fa-f]{1,4})(\.([0-9]{1,2}|high|low))?$")],
    ),
]
"""Protocol address from 0, decimal or hexadecimal, and after a dot the bit or the byte of the register."""
