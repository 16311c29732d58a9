"""What a robot program and the program of its PLC both know of a cell: registers, and the values of the self test.

In the self test, robot program and PLC go through rounds in which every register has a known value. Each variable has
two values, a low and a high one, that its limits and its places allow. In round r a variable has its high value where
bit r of its number (as `gatewayd show` counts) is set. So no two variables are alike in all rounds: an address, a bit,
or a word order that is wrong is seen, with its name. Each link makes its half from what is here.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Final

from gatewayd.core.definition import CellDefinition, Value, ValueKind, Variable

_WORD: Final = re.compile(r"(?:input|output)_bit_registers(0|32)_to_(?:31|63)")
_REGISTER: Final = re.compile(r"(?:input|output)_(?:bit|int|double)_register_(\d+)")
_HIGH: Final = (16909060, 258, 3, 1)
"""Values whose bytes differ (01 02 03 04h, 01 02h) show a wrong order; smaller ones are for narrow limits."""
_APART: Final = 4
"""A real is right within this part of the distance between its values: registers may round it."""


@dataclass(frozen=True, slots=True)
class SelfTestValues:
    """What a variable has in a round, by one bit of its number."""

    low: Value
    high: Value

    def of_round(self, number: int, test_round: int) -> Value:
        """The value in a round of the variable with this number."""
        return self.high if number >> test_round & 1 else self.low

    @property
    def tolerance(self) -> float:
        """How far a value may be off."""
        return abs(float(self.high) - float(self.low)) / _APART


def register_number(variable: Variable) -> int | None:
    """The number of the register that a script's functions take; None for what is no single register."""
    word = _WORD.fullmatch(variable.field)
    if word is not None:
        return None if variable.bit is None else int(word[1]) + variable.bit
    register = _REGISTER.fullmatch(variable.field)
    return int(register[1]) if register is not None and variable.bit is None else None


def self_test_rounds(cell: CellDefinition) -> int:
    """How many rounds tell all registers of the cell apart; in the last one all have their low value.

    It depends on nothing that the two halves are asked for one by one, so that they agree.
    """
    numbers = (variable.number for variable in cell.variables if register_number(variable) is not None)
    return max(numbers, default=0).bit_length() + 1


def values_of(variable: Variable) -> SelfTestValues:
    """The values of a variable: within its limits, its type, and what all its places can show."""
    if variable.kind is ValueKind.BOOL:
        return SelfTestValues(low=False, high=True)
    least, greatest = _range(variable)
    low: float = 0 if least <= 0 <= greatest else _whole(least, greatest)
    fitting = (value for value in _HIGH if least <= value <= greatest and value != low)
    high = next(fitting, _other_end(low, least, greatest))
    if variable.kind is ValueKind.FLOAT:
        return SelfTestValues(float(low), float(high))
    return SelfTestValues(round(low), round(high))


def _range(variable: Variable) -> tuple[float, float]:
    ends = [(variable.low, variable.high), variable.shown or (None, None)]
    if variable.limits is not None:
        ends.append((variable.limits.low, variable.limits.high))
    least = max((low for low, _ in ends if low is not None), default=-math.inf)
    greatest = min((high for _, high in ends if high is not None), default=math.inf)
    return least, greatest


def _whole(least: float, greatest: float) -> float:
    """A whole number near the end that is nearer to 0; the end itself where there is none."""
    near = math.ceil(least) if least > 0 else math.floor(greatest)
    return near if least <= near <= greatest else (least if least > 0 else greatest)


def _other_end(low: float, least: float, greatest: float) -> float:
    return greatest if low != greatest and math.isfinite(greatest) else least
