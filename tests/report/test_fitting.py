"""Tables on narrow screens: numbers whole, everything within its width, what is left out is named."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.report.fitting import fitted, folded, pieces

TEXTS = st.lists(
    st.sampled_from(
        [
            "400102-400103",
            "-0.05..0.05",
            "raw*0.001",
            "input_double_register_12",
            "holding",
            "x",
            "2s",
            "recipe[0..23]",
            "2000h:01-40",
        ]
    ),
    max_size=6,
).map(" ".join)


@given(TEXTS | st.text())
def test_pieces_are_the_text(text: str) -> None:
    assert "".join(pieces(text)) == text


@given(TEXTS, st.integers(1, 60))
def test_no_number_is_broken(text: str, width: int) -> None:
    numbers = re.compile(r"[0-9]+(?:\.[0-9]+)?")
    assert numbers.findall(folded(text, width)) == numbers.findall(text)


@given(TEXTS, st.integers(24, 60))
def test_lines_are_within_the_width(text: str, width: int) -> None:
    assert all(len(line) <= width for line in folded(text, width).split("\n"))


@given(st.lists(TEXTS, min_size=1, max_size=6), st.integers(1, 120))
def test_a_table_is_within_the_width_or_all_expendable_columns_are_gone(texts: list[str], width: int) -> None:
    columns = {str(number): [text] for number, text in enumerate(texts)}
    found = fitted(columns, width, list(columns)[1:])
    assert set(found.widths) | set(found.dropped) == set(columns)
    total = sum(found.widths.values()) + len(found.widths) - 1
    assert total <= width or list(found.widths) == ["0"]
    for name, least in found.widths.items():
        assert all(len(line) <= least for line in folded(columns[name][0], least).split("\n"))


@pytest.mark.parametrize(
    "text, lines",
    [
        ("400102-400103", ["400102-", "400103"]),
        ("-0.05..0.05", ["-0.05..", "0.05"]),
        ("input_register_0..23", ["input_", "register_0..", "23"]),
    ],
)
def test_where_texts_are_broken(text: str, lines: list[str]) -> None:
    assert folded(text, 9).split("\n") == lines
