"""Writing recipe files, and from one format to the other."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.recipes.declared import (
    DeclaredField,
    DeclaredRecipe,
    RecipeFileError,
    problems_of_key,
)
from gatewayd.rtde.recipes.reading import parse_recipes
from gatewayd.rtde.recipes.writing import plain_text, xml_text
from gatewayd.rtde.types import DataType
from tests.rtde.recipes.samples import GUIDE


def test_the_guides_example_is_written_as_the_guide_has_it() -> None:
    assert xml_text(parse_recipes(GUIDE.encode(), "x.xml").recipes.values()) == GUIDE


def test_text_becomes_xml_with_the_types_of_the_catalogue() -> None:
    names = [*OUTPUTS]
    text = "".join(f"{name}\n" for name in names)
    written = xml_text(parse_recipes(text.encode(), "x.txt").recipes.values())
    recipe = parse_recipes(written.encode(), "x.xml").recipe("out")
    assert recipe.names == tuple(names)
    assert recipe.types == {name: field.type for name, field in OUTPUTS.items()}
    assert plain_text(recipe) == text


def test_a_field_without_a_known_type_is_refused_unless_the_type_is_given() -> None:
    recipes = parse_recipes(b"timestamp\nbrand_new\n", "x.txt").recipes.values()
    with pytest.raises(RecipeFileError) as error:
        xml_text(recipes)
    assert str(error.value).startswith("x.txt:2: the type of brand_new is not known here; ")
    assert '<field name="brand_new" type="UINT8"/>' in xml_text(recipes, {"brand_new": DataType.UINT8})


_FIELDS = st.lists(
    st.sampled_from([*INPUTS.values(), *OUTPUTS.values()]), min_size=1, unique_by=lambda field: field.name
)
_KEYS = st.text(min_size=1, max_size=20).filter(lambda key: not list(problems_of_key(key)))


@given(st.dictionaries(_KEYS, _FIELDS, min_size=1, max_size=4))
def test_what_is_written_is_read_again(made: dict[str, list[DeclaredField]]) -> None:
    recipes = [
        DeclaredRecipe(key, tuple(DeclaredField(field.name, field.type, 0) for field in fields), 0, "x")
        for key, fields in made.items()
    ]
    found = parse_recipes(xml_text(recipes).encode(), "x.xml").recipes
    assert {key: (recipe.names, recipe.types) for key, recipe in found.items()} == {
        recipe.key: (recipe.names, recipe.types) for recipe in recipes
    }
