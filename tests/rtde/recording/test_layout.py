"""Columns of fields, and fields of columns."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.recording.layout import HOST_TIME, column_types, columns, fields_of
from tests.rtde.recording.samples import HEADER, RECIPE, TYPES, recipes


def test_columns_are_named_and_typed_as_in_the_official_client() -> None:
    assert " ".join(columns(RECIPE)) == HEADER
    assert " ".join(kind.word for kind in column_types(RECIPE)) == TYPES
    assert columns(RECIPE, host_time=True)[-1] == HOST_TIME
    assert len(column_types(RECIPE, host_time=True)) == RECIPE.count + 1


@given(recipes(), st.booleans(), st.booleans())
def test_the_header_of_a_recipe_means_this_recipe(recipe: Recipe, host_time: bool, typed: bool) -> None:
    types = column_types(recipe, host_time=host_time) if typed else None
    found, with_time = fields_of(columns(recipe, host_time=host_time), types)
    assert (found.names, found.types, with_time) == (recipe.names, recipe.types, host_time)


def test_all_fields_together_are_told_apart() -> None:
    """Among them registers whose numbers look like elements: output_double_register_0 to 47."""
    recipe = Recipe(list(OUTPUTS), [field.type for field in OUTPUTS.values()])
    assert fields_of(columns(recipe))[0].kinds == recipe.kinds


@pytest.mark.parametrize(
    "header, expected",
    [
        ("new_0 new_1 new_2", "new: VECTOR3D"),
        ("new_0 new_1 new_2 new_3 new_4 new_5 x", "new: VECTOR6D, x: DOUBLE"),
        ("new_0 new_1", "new_0: DOUBLE, new_1: DOUBLE"),
        ("new_0 new_1 new_2 new_3", "new_0: DOUBLE, new_1: DOUBLE, new_2: DOUBLE, new_3: DOUBLE"),
        ("actual_q_1 joint_mode_0", "actual_q_1: DOUBLE, joint_mode_0: INT32"),
        ("actual_q_0 actual_q_1 timestamp", "actual_q_0: DOUBLE, actual_q_1: DOUBLE, timestamp: DOUBLE"),
        ("runtime_state new", "runtime_state: UINT32, new: DOUBLE"),
    ],
)
def test_headers_that_others_have_written(header: str, expected: str) -> None:
    assert repr(fields_of(header.split())[0]) == f"Recipe({expected})"


@pytest.mark.parametrize(
    "types, expected",
    [
        ("INT32 " * 6, "new: VECTOR6INT32"),
        ("UINT32 " * 6, "new: VECTOR6UINT32"),
        ("UINT8 " * 6, ", ".join(f"new_{place}: UINT8" for place in range(6))),
        ("DOUBLE " * 5 + "INT32", ", ".join(f"new_{place}: DOUBLE" for place in range(5)) + ", new_5: INT32"),
    ],
)
def test_declared_types_make_the_vector(types: str, expected: str) -> None:
    kinds = [OUTPUTS["timestamp"].type.from_word(word) for word in types.split()]
    assert repr(fields_of([f"new_{place}" for place in range(6)], kinds)[0]) == f"Recipe({expected})"


def test_declared_types_go_before_those_of_the_guides() -> None:
    """A newer controller may have wider ones."""
    kinds = [OUTPUTS["runtime_state"].type]
    assert fields_of(["tool_output_mode"], kinds)[0].kinds == {"tool_output_mode": kinds[0]}


def test_a_column_that_is_there_twice() -> None:
    with pytest.raises(ValueError, match="the column robot_mode is there twice"):
        fields_of(["robot_mode", "timestamp", "robot_mode"])
