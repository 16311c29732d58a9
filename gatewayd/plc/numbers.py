"""Numbers on the wire and in the PLC: which elementary type has which, and in what a scaled one is calculated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from gatewayd.core.definition import ValueKind

REALS: Final = frozenset({"REAL", "LREAL"})
_REAL_STEPS: Final = 1 << 24
"""A REAL tells so many numbers from 0 apart."""


@dataclass(frozen=True, slots=True)
class Number:
    """A type on the wire."""

    type: str
    """Elementary type of a value that is the raw number."""
    size: int
    """Bytes in the PLC."""
    low: float
    high: float
    """Of an integer; of a real the greatest finite ones."""

    @property
    def is_real(self) -> bool:
        """Whether it is a floating-point number."""
        return self.type in REALS

    @property
    def largest(self) -> float:
        """The greatest LREAL that the integer can hold."""
        return {"LINT": 9223372036854774784.0, "ULINT": 18446744073709549568.0}.get(self.type, self.high)


def _integer(kind: str, size: int, *, signed: bool) -> Number:
    bits = 8 * size
    return Number(kind, size, -(1 << bits - 1) if signed else 0, (1 << bits - signed) - 1)


NUMBERS: Final[Mapping[str, Number]] = {
    "bool": Number("BOOL", 2, 0, 1),
    "int8": _integer("SINT", 1, signed=True),
    "uint8": _integer("USINT", 1, signed=False),
    "int16": _integer("INT", 2, signed=True),
    "uint16": _integer("UINT", 2, signed=False),
    "int32": _integer("DINT", 4, signed=True),
    "uint32": _integer("UDINT", 4, signed=False),
    "int64": _integer("LINT", 8, signed=True),
    "uint64": _integer("ULINT", 8, signed=False),
    "float32": Number("REAL", 4, -3.4028234663852886e38, 3.4028234663852886e38),
    "float64": Number("LREAL", 8, -1.7976931348623157e308, 1.7976931348623157e308),
}
"""Type of the mapping -> what it is."""


def value_type(kind: ValueKind, wire: str, scale: float, offset: float) -> tuple[str, str]:
    """Type of a value that goes over the wire as a number, and that of the arithmetic before it."""
    if kind is ValueKind.BOOL or wire == "bool":
        return "BOOL", ""
    if (scale, offset) == (1, 0):
        return NUMBERS[wire].type, ""
    arithmetic = "REAL" if _fits_real(NUMBERS[wire], scale, offset) else "LREAL"
    return arithmetic, arithmetic


def _fits_real(number: Number, scale: float, offset: float) -> bool:
    """Whether a REAL tells all of its values apart."""
    if number.is_real:
        return number.type == "REAL"
    ends = [abs((raw * scale + offset) / scale) for raw in (number.low, number.high)]
    return max(ends) < _REAL_STEPS
