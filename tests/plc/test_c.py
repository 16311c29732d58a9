"""What the C headers of all links have in common."""

from __future__ import annotations

import pytest

from gatewayd.plc.c import comment


@pytest.mark.parametrize(
    "text, written",
    [
        ("begin /* one */ cycle", "/* begin / * one * / cycle */"),
        ("/*/", "/* / * / */"),
        ("*/*", "/* * / * */"),
    ],
)
def test_no_text_ends_a_comment_or_seems_to_begin_one(text: str, written: str) -> None:
    """Compilers warn of `/*` in a comment, and a PLC programmer may have made warnings errors."""
    assert comment(text) == written
