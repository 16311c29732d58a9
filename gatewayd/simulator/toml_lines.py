"""Where a key stands in a TOML document: the parser of the standard library does not say so.

It is asked instead: a key begins on the first line with which the document, cut off there, has it. A statement that
goes over several lines is closed where it was cut off.
"""

from __future__ import annotations

import tomllib
from typing import Any

Path = tuple[str, ...]
"""Names of tables, and last the key."""

_CLOSERS = ("", '"""', "'''", "]", '"""]', "''']", "}")


def line_of(text: str, path: Path) -> int:
    """The line, from 1, on which the key at `path` begins; `text` as a whole is valid and has it."""
    lines = text.splitlines(keepends=True)
    low, high = 1, len(lines)
    while low < high:
        middle = (low + high) // 2
        if _has(_cut(lines[:middle]), path):
            high = middle
        else:
            low = middle + 1
    return low


def text_lines(text: str, path: Path) -> list[tuple[int, str]]:
    """The lines of the string at `path`, each with its line in the document.

    All have the key's line if the string stands on one.
    """
    first = line_of(text, path)
    value: Any = tomllib.loads(text)
    for name in path:
        value = value[name]
    opening = text.splitlines()[first - 1]
    parts = str(value).splitlines()
    quote = next((quote for quote in ('"""', "'''") if opening.count(quote) == 1), None)
    if quote is None:
        return [(first, part) for part in parts]
    begin = first + opening.rstrip().endswith(quote)
    return [(begin + number, part) for number, part in enumerate(parts)]


def _cut(lines: list[str]) -> dict[str, Any]:
    text = "".join(lines)
    for closer in _CLOSERS:
        try:
            return tomllib.loads(text + closer)
        except ValueError:
            continue
    return {}


def _has(value: Any, path: Path) -> bool:
    for name in path:
        if not isinstance(value, dict) or name not in value:
            return False
        value = value[name]
    return True
