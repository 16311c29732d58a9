"""What follows from the names of RTDE fields: bits of words, similar names, and who may have claimed an input."""

from __future__ import annotations

import difflib
import re
from typing import TYPE_CHECKING

from gatewayd.rtde.fields import BITS_PER_WORD, INPUTS, OUTPUTS, SoftwareVersion

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

_WORDS = {
    "input": ("input_bit_registers0_to_31", "input_bit_registers32_to_63"),
    "output": ("output_bit_registers0_to_31", "output_bit_registers32_to_63"),
}
_ALL_NAMES = tuple(dict.fromkeys((*INPUTS, *OUTPUTS)))
_REGISTER = re.compile(r"input_(?:int|double)_register_([0-9]+)")
_FIELDBUS_REGISTERS = 24
_UR_RTDE_LOWER = range(18, 24)
_UR_RTDE_UPPER = range(42, 48)
_LOWER_RANGE = "ur_rtde using its lower range (registers 18-23)"
_NEW_RANGE = "ur_rtde (registers from 0 on PolyScope 5.23 / X 10.9 and newer)"
_NEW_RANGE_SINCE = (SoftwareVersion(5, 23), SoftwareVersion(10, 9))
"""From there on ur_rtde 1.6 uses the registers from 0, whatever range it was told to use."""

OLD_LIST_LIMIT = 2048
"""Bytes of a list of names that every controller takes (older guide, "Introduction"); newer ones take far more."""


def bit_word(side: str, number: int) -> tuple[str, int]:
    """The UINT32 field and the bit in it of general purpose bit `number`, 0 to 63, of "input" or "output".

    The single names (`input_bit_register_5`) are not RTDE fields below 64. ValueError outside the range.
    """
    words = _WORDS[side]
    if not 0 <= number < BITS_PER_WORD * len(words):
        msg = f"general purpose bit {number} is not in the words of bits 0 to 63"
        raise ValueError(msg)
    return words[number // BITS_PER_WORD], number % BITS_PER_WORD


def suggest(name: str, candidates: Iterable[str] = _ALL_NAMES, limit: int = 3) -> tuple[str, ...]:
    """Names that a misspelt one may have meant, likeliest first; by default out of all fields."""
    by_lower = {candidate.lower(): candidate for candidate in candidates}
    return tuple(by_lower[match] for match in difflib.get_close_matches(name.lower(), by_lower, limit, 0.75))


def is_fieldbus_range(name: str) -> bool:
    """Whether the guides reserve the input field for fieldbus and PLC use: bits 0-63, integers and doubles 0-23."""
    if name in _WORDS["input"]:
        return True
    number = _register_number(name)
    return number is not None and number < _FIELDBUS_REGISTERS


def likely_holders(field: str, software: SoftwareVersion | None = None) -> str:
    """Who probably controls an input field for which the controller answers IN_USE, in words for a log.

    RTDE does not say; these are the clients known to claim the field (issues of UR's drivers, ur_rtde's sources) on a
    controller with this software; None: it is not known.
    """
    number = _register_number(field)
    holders = []
    if field not in INPUTS:
        return "another RTDE client"
    if is_fieldbus_range(field):
        holders.append("the robot's PROFINET or EtherNet/IP adapter")
        holders.append("a MODBUS unit configured on the robot")
        if number is not None:
            holders += _ur_rtde(number, software)
    elif number is not None:
        holders.append("a URCap or driver using the upper registers")
        if number in _UR_RTDE_UPPER:
            holders.append("ur_rtde using its upper range (registers 42-47)")
    elif field == "external_force_torque":
        holders.append("a force-torque sensor's URCap or driver")
    elif field.startswith("input_bit_register_"):
        holders.append("a URCap or driver using bits 64-127")
    else:
        holders.append("the robot's PROFINET or EtherNet/IP adapter")
        holders.append("ur_rtde's IO interface or UR's ROS driver")
    return ", ".join(holders) + " or another RTDE client"


def _ur_rtde(number: int, software: SoftwareVersion | None) -> Iterator[str]:
    """What of ur_rtde uses a register below 24."""
    newer = software is not None and any(
        software.major == first.major and software >= first for first in _NEW_RANGE_SINCE
    )
    if number in _UR_RTDE_LOWER and not newer:
        yield _LOWER_RANGE
    if newer or (software is None and number not in _UR_RTDE_LOWER):
        yield _NEW_RANGE


def _register_number(name: str) -> int | None:
    """Number of an integer or double input register."""
    match = _REGISTER.fullmatch(name)
    return int(match[1]) if match is not None else None


def list_size(names: Sequence[str]) -> int:
    """Bytes of a list of names."""
    return len(",".join(names))


def is_long(names: Sequence[str]) -> bool:
    """Whether an old controller may refuse a list of these names for its length."""
    return list_size(names) > OLD_LIST_LIMIT
