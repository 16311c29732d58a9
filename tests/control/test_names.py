from __future__ import annotations

import re
from time import process_time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.control.names import MAX_PATTERN, NamePattern


@pytest.mark.parametrize(
    "pattern, name, fits",
    [
        ("", "", True),
        ("", "a", False),
        ("*", "", True),
        ("tcp*", "tcp[2]", True),
        ("tcp[2]", "tcp[2]", True),
        ("tcp[2]", "tcp2", False),
        ("tcp[?]", "tcp[2]", True),
        ("tcp?", "tcp", False),
        ("*_force", "max_force", True),
        ("*_force", "max_forced", False),
        ("a*b*c", "a-b-b-c", True),
        ("**a**", "bab", True),
    ],
)
def test_stars_and_question_marks_are_wild_and_nothing_else(pattern: str, name: str, fits: bool) -> None:
    assert NamePattern(pattern).fits(name) is fits


@given(st.text("ab?*[", max_size=12), st.text("ab[", max_size=12))
def test_it_fits_what_a_regular_expression_would(pattern: str, name: str) -> None:
    expression = "".join({"*": ".*", "?": "."}.get(character, re.escape(character)) for character in pattern)
    assert NamePattern(pattern).fits(name) is bool(re.fullmatch(expression, name))


def test_a_pattern_is_bounded() -> None:
    assert NamePattern("a" * MAX_PATTERN).fits("a" * MAX_PATTERN)
    with pytest.raises(ValueError, match="has 129 characters, at most 128 are allowed"):
        NamePattern("a" * (MAX_PATTERN + 1))


def test_no_pattern_takes_longer_than_the_name_is_long() -> None:
    """Steps grow with the length of the name, not with its product with anything of the pattern."""

    def seconds(length: int) -> float:
        worst, name = NamePattern("*a" * (MAX_PATTERN // 2 - 1) + "*b"), "a" * length
        begun = process_time()
        for _ in range(20):
            assert not worst.fits(name)
        return process_time() - begun

    assert min(seconds(16_000) for _ in range(3)) < 40 * min(seconds(1_600) for _ in range(3))
