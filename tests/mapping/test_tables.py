"""Typed tables: what they take, what they refuse, and where they say that it stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.mapping.tables import TypedTable, read
from gatewayd.mapping.typed import (
    AfterValidator,
    BeforeValidator,
    Field,
    InstanceOf,
    Invalid,
    Mistake,
    Path,
    ValueRefused,
)


@dataclass(frozen=True)
class Place:
    number: int


def _place(value: object) -> object:
    if value == "nowhere":
        raise ValueRefused("bad-place", "`nowhere` is no place", "name one")
    return Place(value) if isinstance(value, int) else value


def _even(value: int) -> int:
    if value % 2:
        raise ValueRefused("odd", f"{value} is odd", f"write {value + 1}")
    return value


def _count(value: object) -> object:
    return len(value) if isinstance(value, str) else value


class Inner(TypedTable):
    """A table in a table."""

    name: str
    even: Annotated[int, AfterValidator(_even)] = 0


class Base(TypedTable):
    """Keys that come first."""

    first: bool = Field(default=False, description="the first")


class Outer(Base):
    """A table with one key of each kind."""

    note: ClassVar[str] = "no key"
    text: Annotated[str, Field(min_length=1, max_length=4, pattern="^[a-z]+$")] = "abc"
    whole: int = Field(default=1, ge=1, lt=10)
    count: Annotated[int, BeforeValidator(_count)] = Field(default=1, le=5)
    real: float | None = Field(default=None, gt=0, le=2)
    word: Literal["one", "two", "three"] = "one"
    pair: tuple[float, float] | None = None
    many: Annotated[tuple[int, ...], Field(max_length=2)] = ()
    either: int | Literal["auto"] = "auto"
    place: Annotated[InstanceOf[Place], BeforeValidator(_place)] = Place(0)
    inner: Inner | None = None
    named: dict[Annotated[str, Field(pattern="^[a-z]$")], Inner] = Field(default_factory=dict)

    def judge(self) -> None:
        """`first` has a limit of its own."""
        if self.first and self.whole > 5:
            raise ValueRefused("too-much", "too much at first", "write less")


def mistakes(value: object) -> list[tuple[str, Path, Mapping[str, Any]]]:
    with pytest.raises(Invalid) as caught:
        Outer.model_validate(value)
    return [tuple(mistake) for mistake in caught.value.mistakes]  # type: ignore[misc]


def test_keys_have_the_order_of_their_declaration_and_bases_first() -> None:
    assert list(Outer.model_fields)[:4] == ["first", "text", "whole", "count"]
    assert "note" not in Outer.model_fields
    assert Outer.model_fields["first"].description == "the first"
    assert [name for name, key in Inner.model_fields.items() if key.is_required()] == ["name"]


def test_what_is_not_written_has_its_default() -> None:
    table = Outer.model_validate({"whole": 2})
    assert (table.first, table.text, table.whole, table.real, table.place) == (
        False,
        "abc",
        2,
        None,
        Place(0),
    )
    assert table.model_fields_set == {"whole"}
    assert table.named == {}
    assert table.named is not Outer().named


def test_values_become_what_their_type_says() -> None:
    table = Outer.model_validate(
        {
            "real": 2,
            "pair": [1, 2.5],
            "many": [1, 2],
            "either": 7,
            "place": 3,
            "count": "four",
            "inner": {"name": "x", "even": 4},
            "named": {"a": {"name": "y"}},
        }
    )
    assert (table.real, type(table.real), table.pair, table.many) == (2.0, float, (1.0, 2.5), (1, 2))
    assert (table.either, table.place, table.count) == (7, Place(3), 4)
    assert table.inner == Inner(name="x", even=4)
    assert table.named == {"a": Inner(name="y")}
    assert Outer.model_validate(table) is table


@pytest.mark.parametrize(
    "key, value, kind, context",
    [
        ("first", 1, "bool_type", {}),
        ("first", "true", "bool_type", {}),
        ("text", 5, "string_type", {}),
        ("text", "", "string_too_short", {}),
        ("text", "abcde", "string_too_long", {}),
        ("text", "a1", "string_pattern_mismatch", {}),
        ("text", "a\n", "string_pattern_mismatch", {}),
        ("whole", True, "int_type", {}),
        ("whole", 1.0, "int_type", {}),
        ("whole", "1", "int_type", {}),
        ("whole", 0, "greater_than_equal", {"ge": 1}),
        ("whole", 10, "less_than", {"lt": 10}),
        ("count", "sixsix", "less_than_equal", {"le": 5}),
        ("real", True, "float_type", {}),
        ("real", "1.0", "float_type", {}),
        ("real", 0, "greater_than", {"gt": 0.0}),
        ("real", 3, "less_than_equal", {"le": 2.0}),
        ("real", 10**400, "float_type", {}),
        ("word", "four", "literal_error", {"expected": "'one', 'two' or 'three'"}),
        ("word", True, "literal_error", {"expected": "'one', 'two' or 'three'"}),
        ("pair", 1, "tuple_type", {}),
        ("pair", [1, 2, 3], "too_long", {}),
        ("many", "12", "tuple_type", {}),
        ("many", [1, 2, 3], "too_long", {}),
        ("either", "manual", "int_type", {}),
        ("place", "here", "is_instance_of", {}),
        ("place", "nowhere", "bad-place", {"message": "`nowhere` is no place", "hint": "name one"}),
        ("inner", "x", "model_type", {}),
        ("named", [], "dict_type", {}),
    ],
)
def test_a_wrong_value_is_refused(key: str, value: object, kind: str, context: dict[str, Any]) -> None:
    assert mistakes({key: value}) == [(kind, (key,), context)]


def test_a_fault_says_where_it_is() -> None:
    assert mistakes({"pair": [1]}) == [("missing", ("pair", 1), {})]
    assert mistakes({"pair": [1, "x"]}) == [("float_type", ("pair", 1), {})]
    assert mistakes({"many": [1, "x"]}) == [("int_type", ("many", 1), {})]
    assert mistakes({"inner": {}}) == [("missing", ("inner", "name"), {})]
    assert mistakes({"inner": {"name": "x", "even": 3}}) == [
        ("odd", ("inner", "even"), {"message": "3 is odd", "hint": "write 4"})
    ]
    assert mistakes({"named": {"A": {"name": 1}}}) == [
        ("string_pattern_mismatch", ("named", "A", "[key]"), {}),
        ("string_type", ("named", "A", "name"), {}),
    ]


def test_all_faults_of_a_table_are_found_at_once_and_keys_that_it_has_not() -> None:
    found = mistakes({"whole": 0, "inner": {"nmae": "x"}, "wohle": 1, "first": "no"})
    assert [(kind, path) for kind, path, _ in found] == [
        ("bool_type", ("first",)),
        ("greater_than_equal", ("whole",)),
        ("missing", ("inner", "name")),
        ("extra_forbidden", ("inner", "nmae")),
        ("extra_forbidden", ("wohle",)),
    ]


def test_values_are_judged_together_once_each_is_right() -> None:
    assert mistakes({"first": True, "whole": 6}) == [
        ("too-much", (), {"message": "too much at first", "hint": "write less"})
    ]
    assert [kind for kind, _, _ in mistakes({"first": True, "whole": 6, "text": 1})] == ["string_type"]


def test_what_is_made_in_code_is_checked_too() -> None:
    with pytest.raises(Invalid, match="whole: greater_than_equal"):
        Outer(whole=0)


def test_equal_tables_are_one_to_a_dictionary() -> None:
    assert Inner(name="x") == Inner.model_validate({"name": "x", "even": 0})
    assert len({Inner(name="x"), Inner(name="x"), Inner(name="y")}) == 2
    assert Inner(name="x") != "x"
    assert repr(Inner(name="x")) == "Inner(name='x', even=0)"


def test_a_type_alone_is_read_as_well() -> None:
    assert read(tuple[int, ...], [1, 2]) == (1, 2)
    with pytest.raises(Invalid) as caught:
        read(int, "x")
    assert caught.value.mistakes == (Mistake("int_type", (), {}),)


_anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(list(Outer.model_fields)), inner)
    ),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from([*Outer.model_fields, "foreign"]), _anything))
def test_whatever_is_written_is_read_or_refused(value: dict[str, object]) -> None:
    try:
        table = Outer.model_validate(value)
    except Invalid:
        return
    assert table.model_fields_set == value.keys()
    assert 1 <= table.whole < 10
    assert table.real is None or 0 < table.real <= 2
    assert not isinstance(table.either, float)
