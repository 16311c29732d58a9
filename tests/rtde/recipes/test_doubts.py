"""What a controller will probably object to."""

from __future__ import annotations

import pytest

from gatewayd.rtde.recipes.doubts import doubts
from gatewayd.rtde.recipes.reading import parse_recipes
from tests.rtde.recipes.samples import GUIDE


def found(data: bytes) -> list[str]:
    recipes = parse_recipes(data, "x").recipes.values()
    return [f"{doubt.line}: {doubt.text}" for recipe in recipes for doubt in doubts(recipe)]


def test_the_guides_example_raises_none() -> None:
    assert found(GUIDE.encode()) == []


@pytest.mark.parametrize(
    "data, expected",
    [
        (
            b"timestamp\nactual_tcp_pos\n",
            "2: actual_tcp_pos is in no guide; did you mean actual_TCP_pose or ",
        ),
        (b"brand_new\n", "1: brand_new is in no guide"),
        (
            GUIDE.replace('_0" type="INT32"', '_0" type="UINT32"', 1).encode(),
            "8: output_int_register_0 is declared as UINT32; the guides have INT32",
        ),
    ],
)
def test_other_fields_and_types_are_named(data: bytes, expected: str) -> None:
    assert found(data)[0].startswith(expected)
    assert len(found(data)) == 1
