"""Conditions: examples, a second evaluator for random ones, and whatever else people may type."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.cli.rtde.conditions import ConditionError, parse_condition
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

RECIPE = Recipe(
    ["runtime_state", "actual_TCP_force", "bits", "ok", "scale"],
    [DataType.UINT32, DataType.VECTOR6D, DataType.UINT64, DataType.BOOL, DataType.DOUBLE],
)
VALUES = (2, 0.0, 1.0, 55.0, 3.0, 4.0, 5.0, 1 << 40 | 5, True, -0.5)


@pytest.mark.parametrize(
    "text, holds",
    [
        ("runtime_state == 2", True),
        ("runtime_state=2", True),
        ("runtime_state == running", True),
        ("runtime_state == PAUSED", False),
        ("runtime_state != 0x2", False),
        ("actual_TCP_force[2] > 50", True),
        ("actual_TCP_force[2] > 5.5e1", False),
        ("actual_TCP_force[2] >= 5.5e1", True),
        ("bits.40", True),
        ("not bits.1 and bits.2 == 1", True),
        ("bits.0 == off", False),
        ("ok", True),
        ("not ok or scale < -.25", True),
        ("ok == true and (runtime_state == 1 or scale == -0.5)", True),
        ("not not ok", True),
        ("runtime_state == 1 or ok and scale > 0", False),
    ],
)
def test_examples(text: str, *, holds: bool) -> None:
    assert parse_condition(text).test(RECIPE)(VALUES) is holds


def test_the_fields_are_those_that_it_needs() -> None:
    condition = parse_condition("not (b.3 or a[1] > 2) and b == 1")
    assert condition.fields == ("b", "a")


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "column 1: the name of a field is expected, not the end"),
        ("runtime_state ==", "column 17: a number, or one of stopping, stopped"),
        ("runtime_state == 2 2", "column 20: `and`, `or` or the end is expected, not '2'"),
        ("runtime_state == running_fast", "column 18: a number, or one of"),
        ("2 == runtime_state", "column 1: the name of a field"),
        ("(ok", "column 4: `)` is expected, not the end"),
        ("ok && ok", "column 4: '&' has no meaning here"),
        ("ok and", "column 7"),
        ("and ok", "column 1"),
        ("(" * 60 + "ok" + ")" * 60, "nested too deeply"),
        ("ok or " * 300 + "ok", "longer than"),
    ],
)
def test_what_cannot_be_understood_is_refused_with_its_place(text: str, words: str) -> None:
    with pytest.raises(ConditionError) as refused:
        parse_condition(text)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    "text, words",
    [
        ("safety_mode == 1", "there is no field safety_mode"),
        ("actual_TCP_force > 5", "say which element, actual_TCP_force[0] to actual_TCP_force[5]"),
        ("actual_TCP_force[6] > 5", "write actual_TCP_force[0] to actual_TCP_force[5]"),
        ("ok[0]", "ok is BOOL, write ok alone"),
        ("scale.3", "scale is DOUBLE, which has no bits"),
        ("runtime_state.32", "runtime_state is UINT32, with bits 0 to 31"),
    ],
)
def test_what_the_packages_do_not_have_is_refused(text: str, words: str) -> None:
    with pytest.raises(ConditionError) as refused:
        parse_condition(text).test(RECIPE)
    assert words in str(refused.value)


COMPARISONS = st.builds(
    lambda field, sign, number: f"{field} {sign} {number}",
    st.sampled_from(["x", "y", "z"]),
    st.sampled_from(["==", "!=", "<", "<=", ">", ">="]),
    st.integers(-3, 3),
)
EXPRESSIONS = st.recursive(
    COMPARISONS | st.sampled_from(["x", "y", "z"]),
    lambda parts: (
        st.builds("({} and {})".format, parts, parts)
        | st.builds("{} or {}".format, parts, parts)
        | st.builds("not ({})".format, parts)
        | st.builds("{} and not {}".format, parts, st.sampled_from(["x", "z"]))
    ),
    max_leaves=8,
)


@given(EXPRESSIONS, st.tuples(*[st.integers(-3, 3)] * 3))
def test_random_conditions_mean_what_python_means_by_them(text: str, values: tuple[int, ...]) -> None:
    recipe = Recipe(["x", "y", "z"], [DataType.INT32] * 3)
    expected = eval(text, {}, dict(zip("xyz", values, strict=True)))  # noqa: S307 - the text is of this test
    assert parse_condition(text).test(recipe)(values) is bool(expected)


WORDS = ["a", "and", "or", "not", "(", ")", "==", "<", "1", "0x", ".5", "[1]", ".3"]


@given(
    st.text(max_size=60)
    | st.lists(
        st.sampled_from(["a", "and", "or", "not", "(", ")", "==", "<", "1", "0x", ".5", "[1]", ".3"])
    ).map(" ".join)
)
def test_whatever_is_typed_is_read_or_refused(text: str) -> None:
    with suppress(ConditionError):
        parse_condition(text).test(RECIPE)
