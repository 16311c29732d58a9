"""Lines on narrow screens."""

from __future__ import annotations

import pytest
from rich.text import Text

from gatewayd.report.screen import wrapped

LINE = "  last refusal 3.2 s ago: hmi wrote limit = 999 N: refused, out of limits 0 to 150"


@pytest.mark.parametrize("width", [20, 40, 60, 72, 80, 120])
def test_lines_are_broken_between_words_and_lose_nothing(width: int) -> None:
    lines = [line.plain for line in wrapped(Text(LINE), width)]
    assert max(map(len, lines)) <= width
    assert " ".join(" ".join(lines).split()) == LINE.strip()
    assert lines[0].startswith("  last")
    assert all(line.startswith("    ") for line in lines[1:])


def test_colours_stay_with_their_words() -> None:
    text = Text("a ").append("bad thing", "red").append(" was seen")
    lines = wrapped(text, 9, indent=2)
    assert [line.plain for line in lines] == ["a bad", "  thing", "  was", "  seen"]
    assert [any(span.style == "red" for span in line.spans) for line in lines] == [True, True, False, False]


def test_only_a_word_that_is_longer_than_a_line_is_broken() -> None:
    lines = [line.plain for line in wrapped(Text("a " + "x" * 30), 20, indent=2)]
    assert lines == ["a", "  " + "x" * 18, "  " + "x" * 12]
    indented = [line.plain for line in wrapped(Text("  " + "x" * 30), 20, indent=2)]
    assert indented == ["  " + "x" * 18, "  " + "x" * 12]
    assert [line.plain for line in wrapped(Text(""), 20)] == [""]
