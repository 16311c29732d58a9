from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.report.format import counted
from gatewayd.rtde.codec import ProtocolError
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

ELEMENTS: dict[str, st.SearchStrategy[Any]] = {
    "?": st.booleans(),
    "B": st.integers(0, 2**8 - 1),
    "I": st.integers(0, 2**32 - 1),
    "Q": st.integers(0, 2**64 - 1),
    "i": st.integers(-(2**31), 2**31 - 1),
    "d": st.floats(allow_nan=False),
}


@st.composite
def filled_recipes(draw: st.DrawFn) -> tuple[Recipe, list[Any]]:
    types = draw(st.lists(st.sampled_from(DataType), max_size=30))
    recipe = Recipe([f"field{number}" for number in range(len(types))], types)
    values = [draw(ELEMENTS[kind.code]) for kind in types for _ in range(kind.count)]
    return recipe, values


@given(filled_recipes())
def test_values_survive_packing(filled: tuple[Recipe, list[Any]]) -> None:
    recipe, values = filled
    payload = recipe.pack(values)
    assert len(payload) == recipe.size
    assert recipe.unpack(payload) == tuple(values)
    assert recipe.unpack_from(b"head" + payload + b"rest", 4) == tuple(values)


@pytest.mark.parametrize(
    "kind, size",
    [
        (DataType.BOOL, 1),
        (DataType.UINT8, 1),
        (DataType.UINT32, 4),
        (DataType.UINT64, 8),
        (DataType.INT32, 4),
        (DataType.DOUBLE, 8),
        (DataType.VECTOR3D, 24),
        (DataType.VECTOR6D, 48),
        (DataType.VECTOR6INT32, 24),
        (DataType.VECTOR6UINT32, 24),
    ],
)
def test_types_have_the_guides_sizes(kind: DataType, size: int) -> None:
    assert Recipe(["x"], [kind]).size == size
    assert DataType.from_word(kind.word) is kind
    assert kind.is_vector is (kind.count > 1)


def test_layout_is_packed_and_big_endian() -> None:
    recipe = Recipe(["flag", "number", "ratio"], [DataType.BOOL, DataType.INT32, DataType.DOUBLE])
    assert recipe.pack([True, -2, 1.0]) == bytes.fromhex("01 fffffffe 3ff0000000000000")


def test_any_byte_but_zero_is_true() -> None:
    values = Recipe(["a", "b"], [DataType.BOOL, DataType.BOOL]).unpack(b"\x02\x00")
    assert values == (True, False)
    assert isinstance(values[0], bool)


def test_slots_tell_where_vectors_lie_in_the_flat_tuple() -> None:
    recipe = Recipe(["timestamp", "pose", "mode"], [DataType.DOUBLE, DataType.VECTOR6D, DataType.INT32])
    assert recipe.slots == {"timestamp": slice(0, 1), "pose": slice(1, 7), "mode": slice(7, 8)}


def test_not_a_number_and_infinity_pass() -> None:
    nan, infinity = Recipe(["a", "b"], [DataType.DOUBLE] * 2).unpack(struct.pack(">2d", math.nan, math.inf))
    assert math.isnan(nan)
    assert infinity == math.inf


@pytest.mark.parametrize("length", [0, 7, 9, 100])
def test_a_payload_of_another_length_is_a_protocol_error(length: int) -> None:
    with pytest.raises(ProtocolError, match=f"{counted(length, 'byte')} of values, the recipe has 8"):
        Recipe(["timestamp"], [DataType.DOUBLE]).unpack(bytes(length))


@pytest.mark.parametrize(
    "values, words",
    [
        ([1, 2**31], r"b is INT32 and cannot hold 2147483648"),
        ([256, 0], r"a is UINT8 and cannot hold 256"),
        ([1], r"1 value for a recipe of 2"),
        (["x", 0], r"a is UINT8 and cannot hold 'x'"),
    ],
)
def test_what_cannot_be_packed_is_named(values: list[Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Recipe(["a", "b"], [DataType.UINT8, DataType.INT32]).pack(values)


def test_names_and_types_must_pair_up() -> None:
    with pytest.raises(ValueError, match="2 names but 1 type"):
        Recipe(["a", "b"], [DataType.BOOL])


def test_a_recipe_shows_its_fields() -> None:
    assert repr(Recipe(["timestamp"], [DataType.DOUBLE])) == "Recipe(timestamp: DOUBLE)"
