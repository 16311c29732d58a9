"""What a program wants of a robot: names of fields, with their types where it declares them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeAlias

from gatewayd.rtde.api.errors import TypeDifference, TypesDifferError
from gatewayd.rtde.catalogue import suggest
from gatewayd.rtde.fields import INPUTS
from gatewayd.rtde.session import Session
from gatewayd.rtde.types import DataType


class DeclaredFields(Protocol):
    """A recipe with declared types, as `gatewayd.rtde.recipes` reads it from a file."""

    @property
    def names(self) -> tuple[str, ...]:
        """Its fields."""
        ...

    @property
    def types(self) -> Mapping[str, DataType]:
        """The types of those that declare one."""
        ...


Fields: TypeAlias = Sequence[str] | Mapping[str, str | DataType | None] | DeclaredFields
"""Names; or types by name (None: not declared); or a recipe of a file."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a program wants of a robot."""

    outputs: tuple[str, ...] = ()
    inputs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    declared_outputs: Mapping[str, DataType] = field(default_factory=dict)
    declared_inputs: Mapping[str, DataType] = field(default_factory=dict)
    frequency: float = 0.0

    @property
    def names(self) -> frozenset[tuple[str, bool]]:
        """Every wanted field, and whether it is an output."""
        inputs = ((name, False) for names in self.inputs.values() for name in names)
        return frozenset((*((name, True) for name in self.outputs), *inputs))

    def check_types(self, session: Session) -> None:
        """TypesDifferError if a field that is there has another type than was declared."""
        inputs = {name: kind for held in session.inputs.values() for name, kind in held.recipe.kinds.items()}
        differences = [
            TypeDifference(name, declared.word, answered[name].word)
            for table, answered in (
                (self.declared_outputs, session.outputs.kinds),
                (self.declared_inputs, inputs),
            )
            for name, declared in table.items()
            if name in answered and answered[name] is not declared
        ]
        if differences:
            raise TypesDifferError(differences)


def wanted(outputs: Fields, inputs: Mapping[str, Fields] | None, frequency: float) -> Wanted:
    """Read the arguments of a program. TypeError or ValueError says what is wrong with them.

    Names that are in no guide are let through: the controller decides. An empty or repeated name, an input recipe
    without a field, and an input in two recipes, where the controller would answer IN_USE, are refused.
    """
    if not 0 <= frequency < math.inf:
        message = (
            f"frequency {frequency} is not a number of packages per second; 0 is the controller's own rate"
        )
        raise ValueError(message)
    given: object = inputs
    if given is not None and not isinstance(given, Mapping):
        message = f"inputs is {given!r}: give the fields of each recipe by its name, say {{'in': [...]}}"
        raise TypeError(message)
    names, declared = _read("outputs", outputs)
    recipes: dict[str, tuple[str, ...]] = {}
    types: dict[str, DataType] = {}
    holders: dict[str, str] = {}
    for key, fields in (inputs or {}).items():
        recipes[key], more = _read(f"input recipe {key!r}", fields)
        if not recipes[key]:
            message = f"input recipe {key!r} has no field"
            raise ValueError(message)
        for name in recipes[key]:
            if (other := holders.setdefault(name, key)) != key:
                message = f"{name} is in the input recipes {other!r} and {key!r}: leave it in one of them"
                raise ValueError(message)
        types |= more
    return Wanted(names, recipes, declared, types, frequency)


def likely_input(name: str) -> str:
    """Which input may have been meant by a name that is none, in words; empty if none comes near."""
    near = () if name in INPUTS else suggest(name, INPUTS)
    return f"; did you mean {' or '.join(near)}?" if near else ""


def _read(what: str, fields: Fields) -> tuple[tuple[str, ...], dict[str, DataType]]:
    if isinstance(fields, str):
        message = f"{what} is the text {fields!r}: give a list of names"
        raise TypeError(message)
    if isinstance(fields, Mapping):
        names = tuple(fields)
        declared = {name: _type(name, kind) for name, kind in fields.items() if kind is not None}
    elif isinstance(fields, Sequence):
        names, declared = tuple(fields), {}
    else:
        names, declared = fields.names, dict(fields.types)
    _check_names(what, names)
    return names, declared


def _check_names(what: str, names: Iterable[object]) -> None:
    seen: set[str] = set()
    for name in names:
        if not isinstance(name, str):
            message = f"{what}: {name!r} is not the name of a field"
            raise TypeError(message)
        if not name or "," in name or name != name.strip():
            message = f"{what}: {name!r} is not the name of a field"
            raise ValueError(message)
        if name in seen:
            message = f"{what}: {name} is there twice"
            raise ValueError(message)
        seen.add(name)


def _type(name: str, kind: str | DataType) -> DataType:
    if isinstance(kind, DataType):
        return kind
    try:
        return DataType.from_word(kind)
    except KeyError:
        words = ", ".join(each.word for each in DataType)
        message = f"{name} is declared as {kind!r}, which is none of {words}"
        raise ValueError(message) from None
