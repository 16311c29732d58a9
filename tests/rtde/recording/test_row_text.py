"""The text of a package, whatever the one before it was."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.recording.row_text import RowText
from tests.rtde.recording.samples import packages_of, recipes

_LARGE = Recipe(list(OUTPUTS), [field.type for field in OUTPUTS.values()])


def expected(values: tuple[Scalar, ...]) -> str:
    return ",".join(repr(int(value) if isinstance(value, bool) else value) for value in values)


@given(st.data())
def test_each_line_is_that_of_its_own_package(data: st.DataObject) -> None:
    recipe = data.draw(recipes())
    text = RowText(recipe, ",")
    for values in data.draw(st.lists(packages_of(recipe), min_size=1, max_size=4)):
        for _ in range(2):
            assert text.line(recipe.pack(values)) == expected(values)


@given(st.lists(st.tuples(st.integers(0, _LARGE.count - 1), st.integers(0, 1)), max_size=20))
def test_of_all_fields_any_may_change_alone(changes: list[tuple[int, int]]) -> None:
    text = RowText(_LARGE, ",")
    values = list(_LARGE.unpack(bytes(_LARGE.size)))
    for place, found in changes:
        values[place] = type(values[place])(found)
        assert text.line(_LARGE.pack(values)) == expected(tuple(values))


def test_the_sign_of_zero_is_kept() -> None:
    recipe = Recipe(["timestamp"], [OUTPUTS["timestamp"].type])
    text = RowText(recipe, " ")
    assert [text.line(recipe.pack([value])) for value in (0.0, -0.0, 0.0)] == ["0.0", "-0.0", "0.0"]
