"""Recipe files of the C++ client (`RTDEClient::readRecipe`): the name of a field on each line, nothing else."""

from __future__ import annotations

from codecs import BOM_UTF8

from gatewayd.rtde.recipes.declared import (
    OUTPUT_KEY,
    DeclaredField,
    DeclaredRecipe,
    RecipeProblem,
    problems_of_name,
    problems_of_repeats,
)

_MAX_PROBLEMS = 20
"""So that a file of another kind is not answered with a line for each of its own."""


def parse_plain(data: bytes, name: str, problems: list[RecipeProblem]) -> list[DeclaredRecipe]:
    """The one recipe of the text, none of an empty one; what is wrong is added to `problems`.

    Empty lines and white space around a name are passed over, which the C++ client would not do.
    """
    fields: list[DeclaredField] = []
    for number, line in enumerate(data.removeprefix(BOM_UTF8).splitlines(), 1):
        field = line.decode(errors="backslashreplace").strip()
        if not field:
            continue
        found = [_problem(number, field, text) for text in problems_of_name(field)]
        problems += found
        if len(problems) >= _MAX_PROBLEMS:
            break
        if not found:
            fields.append(DeclaredField(field, None, number))
    problems += problems_of_repeats(fields)
    return [DeclaredRecipe(OUTPUT_KEY, tuple(fields), 1, name)] if fields else []


def _problem(line: int, field: str, text: str) -> RecipeProblem:
    if field.startswith(("#", "//")):
        text += "; this format has no comments"
    elif "," in field or " " in field:
        text += "; write each field on a line of its own"
    return RecipeProblem(line, text)
