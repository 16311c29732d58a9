"""The text of the C++ client."""

from __future__ import annotations

import pytest

from gatewayd.rtde.recipes.declared import RecipeProblem
from gatewayd.rtde.recipes.plain import parse_plain

NO_NAME = "is no name of a field; one is made of letters, digits and underscores"


@pytest.mark.parametrize(
    "text, expected",
    [
        ("timestamp\n# joints\nactual_q\n", f"2: '# joints' {NO_NAME}; this format has no comments"),
        ("timestamp,actual_q\n", f"1: 'timestamp,actual_q' {NO_NAME}; write each field on a line of its own"),
        ("a\nb\na\n", "3: a is in the recipe already, since line 1; strike one of them"),
        ("\nü\n", f"2: 'ü' {NO_NAME}"),
    ],
)
def test_each_mistake_has_its_line_its_value_and_a_remedy(text: str, expected: str) -> None:
    found: list[RecipeProblem] = []
    parse_plain(text.encode(), "x.txt", found)
    assert [f"{problem.line}: {problem.text}" for problem in found] == [expected]


def test_a_file_of_another_kind_is_not_answered_with_a_line_for_each_of_its_own() -> None:
    found: list[RecipeProblem] = []
    parse_plain(b"\x7fELF!\n" * 1000, "x.txt", found)
    assert len(found) == 20
