"""Writing recipe files for the clients that read them, from whichever format they came."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape

from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.recipes.declared import (
    DeclaredField,
    DeclaredRecipe,
    RecipeFileError,
    RecipeProblem,
)
from gatewayd.rtde.types import DataType


def xml_text(recipes: Iterable[DeclaredRecipe], types: Mapping[str, DataType] | None = None) -> str:
    """The XML of the Python client. A type that no recipe declares is taken from `types`, or else from the catalogue.

    RecipeFileError where neither has the field, as a file without the type would be of no use.
    """
    lines = ['<?xml version="1.0"?>', "<rtde_config>"]
    for recipe in recipes:
        lines.append(f'  <recipe key="{escape(recipe.key)}">')
        for field in recipe.fields:
            word = _type(recipe, field, types or {}).word
            lines.append(f'    <field name="{field.name}" type="{word}"/>')
        lines.append("  </recipe>")
    return "\n".join([*lines, "</rtde_config>"]) + "\n"


def plain_text(recipe: DeclaredRecipe) -> str:
    """The text of the C++ client: a name on each line. It has no place for the key and the types."""
    return "".join(f"{name}\n" for name in recipe.names)


def _type(recipe: DeclaredRecipe, field: DeclaredField, types: Mapping[str, DataType]) -> DataType:
    if field.type is not None:
        return field.type
    found = types.get(field.name)
    if found is None:
        known = OUTPUTS.get(field.name) or INPUTS.get(field.name)
        found = known.type if known is not None else None
    if found is None:
        text = (
            f"the type of {field.name} is not known here; write the XML by hand, with the controller's type"
        )
        raise RecipeFileError(recipe.file, [RecipeProblem(field.line, text)])
    return found
