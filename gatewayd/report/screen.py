"""Lines for a terminal as wide as it is: broken between words with the rest indented, never cut.

A pipe, a file or a log gets its lines whole: programs read them.
"""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

INDENT = 4
"""Blanks before the rest of a broken line."""


def wrapped(text: Text, width: int, indent: int = INDENT) -> list[Text]:
    """`text` in lines of at most `width` columns; only a word that is longer than a line is broken."""
    console = Console(width=width)
    lines: list[Text] = []
    rest = text
    while True:
        blanks = " " * min(indent, width // 2) if lines else ""
        (first, *_) = rest.wrap(console, width - len(blanks), overflow="fold", no_wrap=False) or [Text()]
        first.rstrip()
        # A word that is longer than a line has the blanks before it alone on one.
        if first.plain or not rest.plain.strip():
            lines.append(Text(blanks, no_wrap=True, overflow="crop", style=text.style).append_text(first))
        rest = rest[len(first.plain) :]
        rest = rest[len(rest.plain) - len(rest.plain.lstrip()) :]
        if not rest.plain:
            return lines
