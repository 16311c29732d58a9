"""What a controller will probably object to in a recipe, before one is asked."""

from __future__ import annotations

from collections.abc import Iterator

from gatewayd.rtde.catalogue import suggest
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.recipes.declared import DeclaredField, DeclaredRecipe, RecipeProblem


def doubts(recipe: DeclaredRecipe) -> Iterator[RecipeProblem]:
    """Fields that no guide has, and declared types that are not those of the guides.

    No more than doubts: the controller's answer decides, and a newer one may have other fields and wider types, as the
    Python client's recipes for version 3 of the protocol have (`configurable_digital_output` as UINT32).
    """
    for field in recipe.fields:
        known = {side[field.name].type for side in (INPUTS, OUTPUTS) if field.name in side}
        if not known:
            yield RecipeProblem(field.line, _unknown(field))
        elif field.type is not None and field.type not in known:
            words = " or ".join(sorted(kind.word for kind in known))
            text = f"{field.name} is declared as {field.type.word}; the guides have {words}"
            yield RecipeProblem(field.line, text)


def _unknown(field: DeclaredField) -> str:
    near = suggest(field.name)
    return f"{field.name} is in no guide" + (f"; did you mean {' or '.join(near)}?" if near else "")
