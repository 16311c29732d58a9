"""What tables are declared with."""

from __future__ import annotations

import pytest

from gatewayd.mapping.typed import Field, Invalid, Key, Mistake


def test_a_key_knows_its_default_and_bounds() -> None:
    key = Field(default=3, ge=1, description="so many")
    assert isinstance(key, Key)
    assert (key.value_without(), key.is_required(), key.bounds, key.description) == (
        3,
        False,
        {"ge": 1},
        "so many",
    )
    assert Field(description="needed").is_required()
    assert Field(default_factory=list).value_without() == []


def test_a_bound_that_nobody_would_hold_is_a_mistake() -> None:
    with pytest.raises(AssertionError):
        Field(default=3, least=1)


def test_what_is_invalid_says_it_in_one_line() -> None:
    invalid = Invalid((Mistake("missing", ("a", 0), {}), Mistake("int_type", (), {})))
    assert str(invalid) == "a.0: missing; : int_type"
