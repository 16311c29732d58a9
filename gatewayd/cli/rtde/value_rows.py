"""The values of a package in words: for `get` and `watch`. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from gatewayd.report.format import value as shown
from gatewayd.rtde.enums import BITS, MEANINGS
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.recipe import Scalar

Value = Scalar | tuple[Scalar, ...]

_WORD_OF_BITS = 64


@dataclass(frozen=True, slots=True)
class ValueRow:
    """One field and its value."""

    name: str
    value: str
    """The number, or those of a vector, with three decimals at most."""
    unit: str
    meaning: str
    """What the number stands for where it is a state: `running`; the bits that are set; else empty."""


def value_row(name: str, value: Value) -> ValueRow:
    """A field in words."""
    known = OUTPUTS.get(name) or INPUTS.get(name)
    numbers = value if isinstance(value, tuple) else (value,)
    text = "  ".join(map(shown, numbers))
    return ValueRow(name, text, known.unit if known is not None else "", _meaning(name, numbers))


def lines(rows: Sequence[ValueRow]) -> list[str]:
    """The rows below one another, names and values in columns."""
    width = max((len(row.name) for row in rows), default=0)
    return [
        "  ".join(part for part in (row.name.ljust(width), row.value, row.unit, _aside(row.meaning)) if part)
        for row in rows
    ]


def as_json(value: Value) -> object:
    """The exact value for programs: numbers, truth values, lists of them; null for what JSON has no number for."""
    if isinstance(value, tuple):
        return [as_json(element) for element in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _meaning(name: str, numbers: Iterable[Scalar]) -> str:
    states = MEANINGS.get(name)
    if states is not None:
        return ", ".join(dict.fromkeys(states.get(int(number), "unknown") for number in numbers))
    first, *more = numbers
    if more or not isinstance(first, int) or isinstance(first, bool):
        return ""
    if name in BITS:
        words = BITS[name]
        return ", ".join(word.on for bit, word in words.items() if first >> bit & 1)
    if "_bits" in name or "_bit_registers" in name:
        return _bits(first)
    return ""


def _bits(number: int) -> str:
    found = [str(bit) for bit in range(_WORD_OF_BITS) if number >> bit & 1]
    return f"bits {', '.join(found)}" if found else "no bit"


def _aside(meaning: str) -> str:
    return f"({meaning})" if meaning else ""
