"""What languages with places in Modbus areas have in common: rules, words for types, what a register shows."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Final

from gatewayd.mapping.reach import Reach, scaled
from gatewayd.modbus.codec import TYPES, Codec

PLACE_RULES: Final = (
    "gatewayd.links.modbus_places.rules.places",
    "gatewayd.links.modbus_places.rules.conversion",
)
"""Modules with the rules that hold for every place in a Modbus area."""
TYPE_SYNONYMS: Final = {
    ("type", "BOOL"): "bit",
    ("type", "INT"): "int16",
    ("type", "UINT"): "uint16",
    ("type", "WORD"): "uint16",
    ("type", "DINT"): "int32",
    ("type", "UDINT"): "uint32",
    ("type", "DWORD"): "uint32",
    ("type", "LINT"): "int64",
    ("type", "ULINT"): "uint64",
    ("type", "LWORD"): "uint64",
    ("type", "REAL"): "float32",
    ("type", "LREAL"): "float64",
    ("type", "FLOAT"): "float32",
    ("type", "DOUBLE"): "float64",
}
"""What the types of IEC 61131-3, and those of C, are called here; to who asks for a float, it is a REAL."""


@lru_cache(maxsize=4096)
def reach_of(codec: Codec, width: int = 0) -> Reach:
    """What a place with this codec shows; `width`: bits of a number that has several bits of a register."""
    number = TYPES[codec.type]
    is_truth = number.name == "bool" and codec.scale == 1 and codec.offset == 0
    if is_truth or number.name == "float64":
        return Reach(None, None, number.is_real)
    high = (1 << width) - 1 if width else number.high
    return scaled(number.low, high, Fraction(codec.scale), Fraction(codec.offset), is_real=number.is_real)
