"""Nothing invisible and nothing that steers a terminal gets through, and nothing else is changed."""

from __future__ import annotations

import json
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.report.printable import MAX_LENGTH, json_text, printable, printable_answer

HOSTILE = {
    "colour": ("\x1b[31mred", "\\x1b[31mred"),
    "C1 control sequence introducer": ("\x9b31m", "\\x9b31m"),
    "line": ("one\r\ntwo", "one\\r\\ntwo"),
    "null and bell": ("\x00\x07", "\\x00\\x07"),
    "line separators": ("a\u2028b\u2029c\x85d", "a\\u2028b\\u2029c\\x85d"),
    "direction": ("\u202egpj.exe\u2066", "\\u202egpj.exe\\u2066"),
    "zero width": ("ro\u200bbot\ufeff\u00ad", "ro\\u200bbot\\ufeff\\xad"),
    "blank letters": ("\u3164\u115f\u2800", "\\u3164\\u115f\\u2800"),
    "variation selectors": ("a\ufe0f\U000e0100", "a\\ufe0f\\U000e0100"),
    "half of a pair": ("\ud800", "\\ud800"),
    "tag characters": ("\U000e0041", "\\U000e0041"),
}
anything = st.text(st.characters(), max_size=200)


@pytest.mark.parametrize("text, shown", HOSTILE.values(), ids=HOSTILE)
def test_what_is_invisible_is_an_escape(text: str, shown: str) -> None:
    assert printable(text) == shown


def test_what_people_write_stays() -> None:
    for text in ("", "robot fresh", "Greifer öffnen, 20 µm", "力 12 °C", "C:\\path", "naïve “quoted”"):
        assert printable(text) == text


def test_what_is_too_long_is_cut_and_says_so() -> None:
    shown = printable("x" * 100_000)
    assert len(shown) == MAX_LENGTH
    assert shown.endswith("... (100000 characters)")
    assert len(printable("\x1b" * MAX_LENGTH)) == MAX_LENGTH, "escapes are longer than what they stand for"


@given(anything, st.integers(40, 300))
def test_one_line_bounded_and_the_same_twice(text: str, limit: int) -> None:
    shown = printable(text, limit)
    assert shown.isprintable()
    assert len(shown) <= limit
    assert printable(shown, limit) == shown
    assert not any(unicodedata.category(one) in ("Cc", "Cf", "Zl", "Zp", "Cs") for one in shown)


def test_answers_are_printable_throughout() -> None:
    answer = {"na\x1bme": ["\u202e", {"a": 1, "b": None, "c": True, "d": 1.5}], "n": "ok"}
    assert printable_answer(answer) == {
        "na\\x1bme": ["\\u202e", {"a": 1, "b": None, "c": True, "d": 1.5}],
        "n": "ok",
    }


@given(st.dictionaries(anything, st.lists(anything, max_size=3), max_size=3), st.sampled_from([None, 2]))
def test_json_stays_exact_and_shows_nothing_invisible(document: dict[str, list[str]], indent: int) -> None:
    text = json_text(json.dumps(document, ensure_ascii=False, indent=indent))
    assert json.loads(text) == document
    assert text.replace("\n", "").isprintable()
