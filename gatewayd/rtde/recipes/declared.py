"""What a recipe file declares, and what may be wrong with it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from gatewayd.report.format import listed
from gatewayd.rtde.catalogue import suggest
from gatewayd.rtde.types import DataType

OUTPUT_KEY = "out"
"""Key of the output recipe by convention: of the Python client's examples, and here of a file that has no keys."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")
_MAX_KEY = 100
_SHOWN = 10


@dataclass(frozen=True, slots=True)
class RecipeProblem:
    """One mistake in a recipe file."""

    line: int
    text: str
    """What is wrong, and what to do."""


class RecipeFileError(ValueError):
    """A recipe file that cannot be used; its text has a line `FILE:LINE: what and remedy` for each problem."""

    def __init__(self, file: str, problems: Sequence[RecipeProblem]) -> None:
        super().__init__("\n".join(f"{file}:{problem.line}: {problem.text}" for problem in problems))
        self.file = file
        self.problems = tuple(problems)


@dataclass(frozen=True, slots=True)
class DeclaredField:
    """A field as a recipe file has it."""

    name: str
    type: DataType | None
    """None: the file declares none, as the text format cannot."""
    line: int


@dataclass(frozen=True, slots=True)
class DeclaredRecipe:
    """A list of fields under a key."""

    key: str
    fields: tuple[DeclaredField, ...]
    line: int
    file: str
    """What the file is called in messages."""

    @property
    def names(self) -> tuple[str, ...]:
        """The fields in their order, as a controller is asked for them."""
        return tuple(field.name for field in self.fields)

    @property
    def types(self) -> Mapping[str, DataType]:
        """The declared types by field, to compare with a controller's answer; fields without one are left out."""
        return {field.name: field.type for field in self.fields if field.type is not None}


@dataclass(frozen=True, slots=True)
class RecipeFile:
    """The recipes of one file by their keys, in its order."""

    name: str
    recipes: Mapping[str, DeclaredRecipe]

    def recipe(self, key: str | None = None) -> DeclaredRecipe:
        """The recipe of that key; without one the only recipe, or `out`. RecipeFileError names the keys there are."""
        wanted = key if key is not None else OUTPUT_KEY
        if wanted in self.recipes:
            return self.recipes[wanted]
        if key is None and len(self.recipes) == 1:
            return next(iter(self.recipes.values()))
        there = listed([repr(known) for known in self.recipes], _SHOWN)
        problem = RecipeProblem(1, f"no recipe has the key {wanted!r}; choose one of {there}")
        raise RecipeFileError(self.name, [problem])


def problems_of_name(name: str) -> Iterator[str]:
    """What keeps a text from being the name of a field. Whether a controller has the field, only it can say."""
    if not name:
        yield "a field without a name; give it one, as in timestamp"
    elif _NAME.fullmatch(name) is None:
        yield f"{name[:100]!r} is no name of a field; one is made of letters, digits and underscores"


def problems_of_type(name: str, word: str) -> Iterator[str]:
    """What keeps a word from being the type of a field. Whether the field has it, only a controller can say."""
    if word not in DataType.__members__:
        near = suggest(word, DataType.__members__, limit=1)
        meant = f"did you mean {near[0]}?" if near else f"the types are {', '.join(DataType.__members__)}"
        yield f"{name} has the type {word[:100]!r}, which RTDE does not have; {meant}"


def problems_of_key(key: str) -> Iterator[str]:
    """What keeps a text from being the key of a recipe."""
    if not key:
        yield f'a recipe without a key; give it one, as in key="{OUTPUT_KEY}"'
    elif len(key) > _MAX_KEY or not key.isprintable():
        yield f"{key[:_MAX_KEY]!r} cannot be a key; choose a short word"


def problems_of_repeats(fields: Sequence[DeclaredField]) -> Iterator[RecipeProblem]:
    """The fields that a recipe names again, at their second place."""
    first: dict[str, int] = {}
    for field in fields:
        if field.name in first:
            text = (
                f"{field.name} is in the recipe already, since line {first[field.name]}; strike one of them"
            )
            yield RecipeProblem(field.line, text)
        first.setdefault(field.name, field.line)
