"""What a program wants: names, declared types, recipes of files."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.rtde.api.wanted import likely_input, wanted
from gatewayd.rtde.recipes.declared import DeclaredField, DeclaredRecipe
from gatewayd.rtde.types import DataType


def test_names_types_and_recipes_of_files_are_read_alike() -> None:
    recipe = DeclaredRecipe(
        "in",
        (DeclaredField("input_int_register_0", DataType.INT32, 1), DeclaredField("x", None, 2)),
        1,
        "in.xml",
    )
    found = wanted({"actual_q": "VECTOR6D", "robot_mode": None}, {"in": recipe, "b": ["y"]}, 125)
    assert found.outputs == ("actual_q", "robot_mode")
    assert found.declared_outputs == {"actual_q": DataType.VECTOR6D}
    assert found.inputs == {"in": ("input_int_register_0", "x"), "b": ("y",)}
    assert found.declared_inputs == {"input_int_register_0": DataType.INT32}
    assert ("x", False) in found.names
    assert ("actual_q", True) in found.names


@pytest.mark.parametrize("fields", ["actual_q", [1]])
def test_what_is_no_list_of_names_is_refused(fields: Any) -> None:
    with pytest.raises(TypeError, match="outputs"):
        wanted(fields, None, 0)


@pytest.mark.parametrize("inputs", [["input_int_register_0"], "in"])
def test_input_recipes_have_names(inputs: Any) -> None:
    with pytest.raises(TypeError, match="give the fields of each recipe by its name"):
        wanted([], inputs, 0)


@pytest.mark.parametrize("name", ["", "a,b", " a"])
def test_a_name_that_no_field_can_have_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="not the name of a field"):
        wanted([name], None, 0)


def test_a_field_is_in_one_input_recipe_only() -> None:
    with pytest.raises(ValueError, match="x is in the input recipes 'a' and 'c': leave it in one of them"):
        wanted([], {"a": ["w", "x"], "b": ["y"], "c": {"x": "INT32"}}, 0)


def test_a_misspelt_input_gets_a_suggestion() -> None:
    assert likely_input("input_int_register_0") == ""
    assert "input_int_register_0" in likely_input("input_int_registr_0")
