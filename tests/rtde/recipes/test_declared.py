"""Choosing a recipe of a file."""

from __future__ import annotations

import pytest

from gatewayd.rtde.recipes.declared import RecipeFileError
from gatewayd.rtde.recipes.reading import parse_recipes
from gatewayd.rtde.types import DataType
from tests.rtde.recipes.samples import GUIDE


def test_without_a_key_it_is_out_or_the_only_one() -> None:
    assert parse_recipes(GUIDE.encode(), "x.xml").recipe().key == "out"
    only = '<a><recipe key="mine"><field name="payload" type="DOUBLE"/></recipe></a>'
    assert parse_recipes(only.encode(), "x.xml").recipe().key == "mine"


@pytest.mark.parametrize("key", ["in3", None])
def test_a_key_that_is_not_there_is_answered_with_those_that_are(key: str | None) -> None:
    found = parse_recipes(GUIDE.replace('"out"', '"main"').encode(), "x.xml")
    with pytest.raises(RecipeFileError) as error:
        found.recipe(key)
    expected = f"x.xml:1: no recipe has the key {key or 'out'!r}; choose one of 'main', 'in1', 'in2'"
    assert str(error.value) == expected


def test_types_to_compare_with_a_controllers_answer() -> None:
    recipe = parse_recipes(GUIDE.encode(), "x.xml").recipe("in1")
    assert recipe.types == {
        "input_int_register_0": DataType.INT32,
        "input_int_register_1": DataType.INT32,
    }
