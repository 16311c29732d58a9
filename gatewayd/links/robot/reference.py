"""What a `robot:` reference means: the fields, elements and bits of the catalogue that it names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Final

from gatewayd.links.robot.scalars import Reference
from gatewayd.mapping.expanded import UndefinedError
from gatewayd.rtde.catalogue import bit_word
from gatewayd.rtde.fields import INPUTS, OUTPUTS, REGISTERS, Field
from gatewayd.rtde.types import DataType

_FAMILIES: Final = {family.prefix: family for family in REGISTERS}
_BIT_REGISTERS: Final = {"input_bit_register_": "input", "output_bit_register_": "output"}
_NUMBERED = re.compile(r"(.*_)(0|[1-9][0-9]{0,3})")
_WORD_BITS: Final = range(64)
_INPUTS: Final = "input_"


class ReferenceProblem(Enum):
    """Why a `robot:` reference names nothing."""

    UNKNOWN_FIELD = auto()
    NOT_NUMBERED = auto()
    """A range of something that has no numbered registers."""
    NO_SUCH_REGISTER = auto()
    NOT_A_VECTOR = auto()
    NO_SUCH_ELEMENT = auto()
    NOT_AN_INTEGER = auto()
    """Bits of a field that is no integer."""
    NO_SUCH_BIT = auto()


@dataclass(frozen=True, slots=True)
class Target:
    """One value in the robot."""

    name: str
    """In full: `input_bit_register_5`, `actual_TCP_pose[0]`, `robot_mode`."""
    field: Field
    """The field that carries it."""
    type: DataType
    """Of the one value: BOOL for a bit, the element type for a vector."""
    is_input: bool
    bit: int | None = None
    element: int | None = None


class UnresolvedReference(UndefinedError):
    """A reference names nothing known: `name` is the field or the first missing register, `limit` what there is."""

    def __init__(self, problem: ReferenceProblem, name: str, limit: int | None = None) -> None:
        super().__init__()
        self.problem, self.name, self.limit = problem, name, limit


@dataclass(frozen=True, slots=True)
class FieldDeclaration:
    """What a file says of a field besides its name."""

    type: DataType | None = None
    """Goes before the catalogue's, and makes a field usable that the catalogue does not have."""
    is_input: bool | None = None
    """Of a field that the catalogue does not have; None: as its name says."""


_UNDECLARED: Final = FieldDeclaration()


def resolve(reference: Reference, declared: FieldDeclaration = _UNDECLARED) -> list[Target]:
    """Find what a reference names, in the order it is written.

    Bits 0 to 63 are bits of the register words that RTDE has, whatever is declared; a vector without an element is all
    its elements. Raises `UnresolvedReference`.
    """
    if reference.registers is not None:
        return [_register(reference.field, number, declared) for number in reference.registers]
    family = _split_register(reference.field)
    if family is not None:
        whole = _register(*family, declared)
    else:
        whole = _whole(
            reference.field, declared, UnresolvedReference(ReferenceProblem.UNKNOWN_FIELD, reference.field)
        )
    elements = list(_elements(whole, reference.elements))
    if reference.bits is None:
        return elements
    return [bit for element in elements for bit in _bits(element, reference.bits)]


def is_bit_register(reference: Reference) -> bool:
    """Whether it names bits 0 to 63, which are bits of words."""
    family = _split_register(reference.field)
    prefix, numbers = family if family is not None else (reference.field, None)
    if prefix not in _BIT_REGISTERS:
        return False
    first = numbers if numbers is not None else (reference.registers or range(1)).start
    return first in _WORD_BITS


def is_known(reference: Reference) -> bool:
    """Whether the catalogue says the direction of everything that it names."""
    try:
        resolve(reference)
    except UnresolvedReference as error:
        return error.problem not in (
            ReferenceProblem.UNKNOWN_FIELD,
            ReferenceProblem.NOT_NUMBERED,
            ReferenceProblem.NO_SUCH_REGISTER,
        )
    return True


def _whole(name: str, declared: FieldDeclaration, unknown: UnresolvedReference) -> Target:
    """A field as the catalogue has it and the file declares it; raises `unknown` where neither says its type."""
    field = INPUTS.get(name) or OUTPUTS.get(name)
    if field is None:
        if declared.type is None:
            raise unknown
        is_input = declared.is_input if declared.is_input is not None else name.startswith(_INPUTS)
        return Target(name, Field(name, declared.type, "not in the catalogue"), declared.type, is_input)
    if declared.type is not None:
        field = replace(field, type=declared.type)
    return Target(name, field, field.type, name in INPUTS)


def _split_register(field: str) -> tuple[str, int] | None:
    """Split the name of a numbered register; None for other fields."""
    match = _NUMBERED.fullmatch(field)
    if match is None or (match[1] not in _FAMILIES and match[1] not in _BIT_REGISTERS):
        return None
    return match[1], int(match[2])


def _register(prefix: str, number: int, declared: FieldDeclaration) -> Target:
    name = f"{prefix}{number}"
    side = _BIT_REGISTERS.get(prefix)
    if side is not None and number in _WORD_BITS:
        word, bit = bit_word(side, number)
        is_input = side == "input"
        return Target(name, (INPUTS if is_input else OUTPUTS)[word], DataType.BOOL, is_input, bit)
    family = _FAMILIES.get(prefix)
    unknown = (
        UnresolvedReference(ReferenceProblem.NOT_NUMBERED, prefix)
        if family is None
        else UnresolvedReference(ReferenceProblem.NO_SUCH_REGISTER, name, family.numbers[-1])
    )
    return _whole(name, declared, unknown)


def _elements(whole: Target, wanted: range | None) -> Iterator[Target]:
    if not whole.type.is_vector:
        if wanted is not None:
            raise UnresolvedReference(ReferenceProblem.NOT_A_VECTOR, whole.name)
        yield whole
        return
    for element in wanted if wanted is not None else range(whole.type.count):
        if element >= whole.type.count:
            raise UnresolvedReference(ReferenceProblem.NO_SUCH_ELEMENT, whole.name, whole.type.count)
        yield Target(
            f"{whole.name}[{element}]", whole.field, whole.type.element, whole.is_input, whole.bit, element
        )


def _bits(whole: Target, wanted: range) -> Iterator[Target]:
    width = whole.type.bits
    if width is None:
        raise UnresolvedReference(ReferenceProblem.NOT_AN_INTEGER, whole.name)
    for bit in wanted:
        if bit >= width:
            raise UnresolvedReference(ReferenceProblem.NO_SUCH_BIT, whole.name, width)
        yield Target(f"{whole.name}.{bit}", whole.field, DataType.BOOL, whole.is_input, bit, whole.element)
