"""Lines of keys in a TOML document."""

from __future__ import annotations

import pytest

from gatewayd.simulator.toml_lines import line_of, text_lines

TEXT = '''\
# a comment, [robots.right]
[robots.left]
port = 1
list = [
  "a",
  "b",
]
text = """
one

three"""

[robots.right]
text = """first
second"""
flat = "a\\nb"
literal = \'\'\'
x\'\'\'
faults.delay = 2
inline = { port = 3 }
'''


@pytest.mark.parametrize(
    "path,line",
    [
        (("robots",), 2),
        (("robots", "left"), 2),
        (("robots", "left", "port"), 3),
        (("robots", "left", "list"), 4),
        (("robots", "left", "text"), 8),
        (("robots", "right"), 13),
        (("robots", "right", "text"), 14),
        (("robots", "right", "flat"), 16),
        (("robots", "right", "faults", "delay"), 19),
        (("robots", "right", "inline", "port"), 20),
    ],
)
def test_a_key_begins_on_its_line(path: tuple[str, ...], line: int) -> None:
    assert line_of(TEXT, path) == line


@pytest.mark.parametrize(
    "path,lines",
    [
        (("robots", "left", "text"), [(9, "one"), (10, ""), (11, "three")]),
        (("robots", "right", "text"), [(14, "first"), (15, "second")]),
        (("robots", "right", "flat"), [(16, "a"), (16, "b")]),
        (("robots", "right", "literal"), [(18, "x")]),
    ],
)
def test_lines_of_a_string(path: tuple[str, ...], lines: list[tuple[int, str]]) -> None:
    assert text_lines(TEXT, path) == lines
