"""What differs between the tools that take structured text; what is the same is written once, in the other modules."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from gatewayd.plc.model import CellModel
from gatewayd.plc.numbers import REALS
from gatewayd.plc.st.program import ProgramUnit, TypeName


@dataclass(frozen=True, slots=True)
class Primitives:
    """How bits become reals: there is no portable form, so each target has its own."""

    units: Callable[[str], tuple[ProgramUnit, ...]]
    """Functions by the prefix: `ToReal`, `FromReal`, `ToLreal`, `FromLreal`."""
    only_finite: bool = False
    """NaN and the infinities cannot be made: a reader is informed instead."""


@dataclass(frozen=True, slots=True)
class Dialect:
    """One tool's structured text."""

    primitives: Primitives
    names_operands: bool = False
    """`SHL(IN := x, N := 8)` instead of `SHL(x, 8)`."""
    quotes: bool = False
    """Names of the program's own types and blocks stand in quotation marks."""
    enumerations: bool = True
    """Whether there are enumerations; a number and a table of names otherwise."""

    def own(self, name: str) -> str:
        """The name of a type or block of the program itself."""
        return f'"{name}"' if self.quotes else name

    def result(self, name: str) -> str:
        """What a function's result is assigned to."""
        return f"#{name}" if self.quotes else name

    def bit_of(self, number: str) -> str:
        """An INT as the number of places to shift by."""
        return f"INT_TO_UINT({number})" if self.names_operands else number

    def shift(self, function: str, operand: str, by: str) -> str:
        """`SHL`, `SHR` or `ROL`."""
        return (
            f"{function}(IN := {operand}, N := {by})"
            if self.names_operands
            else f"{function}({operand}, {by})"
        )

    def call(self, model: CellModel, function: str, **operands: str) -> str:
        """A call of one of the program's own functions."""
        listed = ", ".join(f"{name} := {value}" for name, value in operands.items())
        return f"{self.own(f'{model.prefix}_{function}')}({listed})"


def word(number: int) -> str:
    """A WORD."""
    return f"WORD#16#{number:04X}"


def real(value: float, type_name: str) -> str:
    """A real, with every digit that it needs: `LREAL#1.0E-05`; NaN and infinities have none and become the greatest."""
    if not math.isfinite(value):
        value = math.copysign(3.402823e38, value)
    mantissa, e, exponent = repr(float(value)).partition("e")
    text = (mantissa if "." in mantissa else f"{mantissa}.0") + (f"E{int(exponent)}" if e else "")
    return f"{type_name}#{text}"


def literal(value: float, type_name: str) -> str:
    """A value of an elementary type."""
    if type_name == "BOOL":
        return "TRUE" if value else "FALSE"
    if type_name in REALS:
        return real(value, type_name)
    return str(round(value))


def elementary(name: str) -> TypeName:
    """A type of the language."""
    return TypeName(name)


def array(name: str, last: int, *, first: int = 0, is_own: bool = False) -> TypeName:
    """An array."""
    return TypeName(name, first, last, is_own)


def own(name: str) -> TypeName:
    """A type of the program itself."""
    return TypeName(name, is_own=True)
