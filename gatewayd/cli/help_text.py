"""Help in the columns of the terminal: click leaves what is laid out by hand as it is, however narrow the screen."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator

import click

_ENTRY = re.compile(r"( *)(\S(?:.*?\S)?)( {2,})(\S.*)")
"""Something and, two blanks or more behind it, what it means."""
_TO_TYPE = re.compile(r" *(gatewayd|git|cell\.yaml:)")
"""What is to be copied, or is shown as it comes: a terminal that wraps it still copies it as one line."""


class FittingFormatter(click.HelpFormatter):
    """Breaks lines between words in paragraphs that are marked with backspace, too."""

    def write_text(self, text: str) -> None:
        """Write a text with its paragraphs."""
        indent = " " * self.current_indent
        wrapped = click.formatting.wrap_text(text, self.width, indent, indent, preserve_paragraphs=True)
        for line in wrapped.split("\n"):
            for shown in fitting(line, self.width):
                self.write(f"{shown}\n")


def fitting(line: str, width: int) -> Iterator[str]:
    """The line, or the lines that it takes in so many columns. A command stays in one piece."""
    if len(line) <= width:
        yield line
        return
    entry = _ENTRY.fullmatch(line)
    if _TO_TYPE.match(line):
        if entry is None:
            yield line
            return
        yield f"{entry[1]}{entry[2]}"
        yield from _wrapped(entry[4], entry[1] + "    ", entry[1] + "    ", width)
    elif entry is not None and entry.start(4) <= width // 2:
        yield from _wrapped(entry[4], line[: entry.start(4)], " " * entry.start(4), width)
    else:
        indent = line[: len(line) - len(line.lstrip())]
        yield from _wrapped(line.strip(), indent, indent + "  ", width)


def _wrapped(text: str, first: str, rest: str, width: int) -> list[str]:
    return textwrap.wrap(
        text,
        width,
        initial_indent=first,
        subsequent_indent=rest,
        break_long_words=False,
        break_on_hyphens=False,
    )
