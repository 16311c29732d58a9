"""The parts of a program in a language of IEC 61131-3, as data: the module that writes files decides on their form."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TypeName:
    """A type, or an array of it."""

    name: str
    first: int = 0
    last: int | None = None
    """None: no array."""
    is_own: bool = False
    """Declared by the program itself, not by the language."""
    is_pointer: bool = False

    @property
    def count(self) -> int:
        """Elements; 1 of what is no array."""
        return 1 if self.last is None else self.last - self.first + 1


@dataclass(frozen=True, slots=True)
class PlcVariable:
    """A variable of a block, or a member of a structure."""

    name: str
    type: TypeName
    comment: str = ""
    initial: str = ""
    address: str = ""
    """`%I*`: the tool gives it a place in the process image."""


@dataclass(frozen=True, slots=True)
class Structure:
    """A data type with members."""

    name: str
    fields: tuple[PlcVariable, ...]
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Enumeration:
    """A data type with names for numbers, from 0 without a gap."""

    name: str
    literals: tuple[tuple[str, str], ...]
    """Name and meaning, in the order of the numbers."""
    comment: str = ""


DataType = Structure | Enumeration


@dataclass(frozen=True, slots=True)
class VariableSection:
    """Variables of one kind."""

    keyword: str
    """`VAR_INPUT`."""
    fields: tuple[PlcVariable, ...]


@dataclass(frozen=True, slots=True)
class ProgramUnit:
    """A function, a function block or a program."""

    keyword: str
    """`FUNCTION`, `FUNCTION_BLOCK`, `PROGRAM`."""
    name: str
    sections: tuple[VariableSection, ...]
    body: tuple[str, ...]
    """Lines."""
    result: str = ""
    """Type of a function."""
    comment: str = ""


def used(lines: Sequence[str], *fields: PlcVariable) -> tuple[PlcVariable, ...]:
    """Those that the lines name."""
    words = set(re.findall(r"[A-Za-z_][A-Za-z0-9_.]*", "\n".join(lines)))
    return tuple(field for field in fields if field.name in words)


def indented(lines: Sequence[str], by: int = 1) -> list[str]:
    """Lines further to the right; empty ones stay empty."""
    return [f"{'  ' * by}{line}" if line else "" for line in lines]
