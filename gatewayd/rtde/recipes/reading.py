"""Reading recipe files, whichever client they were written for."""

from __future__ import annotations

from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path
from typing import TYPE_CHECKING

from gatewayd.rtde.recipes.declared import RecipeFile, RecipeFileError, RecipeProblem
from gatewayd.rtde.recipes.plain import parse_plain
from gatewayd.rtde.recipes.xml import parse_xml

if TYPE_CHECKING:
    from gatewayd.rtde.recipes.declared import DeclaredRecipe

MAX_BYTES = 1 << 20
"""Size of a recipe file at most: all names that there are take some 15 kB."""

_UTF16 = (BOM_UTF16_LE, BOM_UTF16_BE)


def read_recipes(path: str | Path) -> RecipeFile:
    """The recipes of a file: XML of the Python client, or text of the C++ client with a field on each line.

    Which it is shows its content, not its name. A file of text has one recipe, with the key `out`. Raises OSError, and
    RecipeFileError with every mistake that was found.
    """
    with Path(path).open("rb") as file:
        return parse_recipes(file.read(MAX_BYTES + 1), str(path))


def parse_recipes(data: bytes, name: str) -> RecipeFile:
    """The recipes of a file's content; `name` is what the file is called in messages. Raises RecipeFileError."""
    if len(data) > MAX_BYTES:
        text = f"more than {MAX_BYTES // 1024} KiB, far more than recipes take; is it the right file?"
        raise RecipeFileError(name, [RecipeProblem(1, text)])
    parse = parse_xml if _is_xml(data) else parse_plain
    problems: list[RecipeProblem] = []
    recipes = _by_key(parse(data, name, problems), problems)
    if not recipes and not problems:
        problems.append(RecipeProblem(1, "there is no recipe in it; is it the right file?"))
    if problems:
        raise RecipeFileError(name, sorted(problems, key=lambda problem: problem.line))
    return RecipeFile(name, recipes)


def _is_xml(data: bytes) -> bool:
    return data.startswith(_UTF16) or data.removeprefix(BOM_UTF8).lstrip().startswith(b"<")


def _by_key(recipes: list[DeclaredRecipe], problems: list[RecipeProblem]) -> dict[str, DeclaredRecipe]:
    found: dict[str, DeclaredRecipe] = {}
    for recipe in recipes:
        if recipe.key in found:
            text = f"the key {recipe.key!r} is taken, since line {found[recipe.key].line}; choose another"
            problems.append(RecipeProblem(recipe.line, text))
        found.setdefault(recipe.key, recipe)
    return found
