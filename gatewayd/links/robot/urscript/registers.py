"""Which variables of a cell a robot program reads and writes: those that are registers of the controller."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from gatewayd.core.definition import CellDefinition, Direction, ValueKind, Variable
from gatewayd.links.robot_program import register_number

_ELEMENT = re.compile(r"(.+)\[(\d+)\]")
_SCRIPT_TYPES: Final = {ValueKind.BOOL: "boolean", ValueKind.INT: "integer", ValueKind.FLOAT: "float"}


@dataclass(frozen=True, slots=True)
class ScriptRegister:
    """A variable that is a register, or a family of them whose registers follow each other."""

    name: str
    """Of the mapping, without an index."""
    variables: tuple[Variable, ...]
    number: int
    """Of the register; of a family that of its first variable."""
    indexed: bool
    """Whether it is a family: the robot program names the variable by its index."""

    @property
    def first(self) -> Variable:
        """The variable; of a family the first."""
        return self.variables[0]

    @property
    def is_input(self) -> bool:
        """Whether the robot program reads it."""
        return self.first.direction is Direction.INPUT

    @property
    def register(self) -> str:
        """The register as the script's functions name it, without its number: `input_integer_register`."""
        return f"{self.first.direction.value}_{_SCRIPT_TYPES[self.first.kind]}_register"


def registers(cell: CellDefinition) -> tuple[ScriptRegister, ...]:
    """The variables that are registers, in the order of the mapping; elements of a family together."""
    found: dict[str, list[tuple[Variable, int]]] = {}
    for variable in cell.variables:
        number = register_number(variable)
        if number is not None:
            found.setdefault(_base(variable.name), []).append((variable, number))
    return tuple(
        ScriptRegister(
            name,
            tuple(variable for variable, _ in members),
            members[0][1],
            members[0][0].name != name,
        )
        for name, members in found.items()
    )


def others(cell: CellDefinition) -> tuple[str, ...]:
    """Names of the variables that no robot program has as registers, families once."""
    return _once(_base(variable.name) for variable in cell.variables if register_number(variable) is None)


def _base(name: str) -> str:
    element = _ELEMENT.fullmatch(name)
    return name if element is None else element[1]


def _once(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))
