"""Tables in the columns that a screen has: texts are broken between words, numbers never, and what has no room is left
out by name. Pure: texts and a width in, lines out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

GAP = 1
"""Blanks between two columns."""
_PIECE = re.compile(r" +|[^ ]+?(?:_+(?![_0-9])|[0-9]\.\.(?=[-0-9])|[0-9]-(?=[0-9])|(?= |$))")
"""What a line is filled with: a word, a part of a name, one end of a range. `400103-`, `400104`."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """What is shown of a table."""

    widths: Mapping[str, int]
    """Of the columns that are shown, in their order."""
    dropped: tuple[str, ...]
    """Columns for which there is no room, in their order."""


def fitted(texts: Mapping[str, Sequence[str]], width: int, expendable: Sequence[str]) -> Fitted:
    """Widths for columns of texts, heads among them, so that they and the gaps between them are `width` at most.

    Where words are broken over lines as far as they can be and there still is no room, the columns `expendable` are
    dropped, the first ones first. Where that does not do either, the rest keeps what its longest pieces need.
    """
    shown = list(texts)
    least = {name: max(map(_longest, column), default=0) for name, column in texts.items()}
    for name in expendable:
        if _total([least[column] for column in shown]) <= width:
            break
        if name in shown:
            shown.remove(name)
    widths = {name: max(map(len, texts[name]), default=0) for name in shown}
    while _total(list(widths.values())) > width:
        yielding = [name for name in shown if widths[name] > least[name]]
        if not yielding:
            break
        widths[max(yielding, key=lambda name: widths[name] - least[name])] -= 1
    return Fitted(widths, tuple(name for name in texts if name not in widths))


def folded(text: str, width: int) -> str:
    """`text` in lines of at most `width`, as far as its pieces allow."""
    lines = [""]
    for piece in pieces(text):
        if len(lines[-1]) + len(piece.rstrip()) <= width or not lines[-1]:
            lines[-1] += piece
        else:
            lines.append(piece)
        if not lines[-1].strip():
            lines[-1] = ""
    return "\n".join(line.rstrip() for line in lines).rstrip("\n")


@lru_cache(maxsize=4096)
def pieces(text: str) -> tuple[str, ...]:
    """The parts of a text that are never broken; joined they are the text."""
    return tuple(_pieces(text))


def _pieces(text: str) -> Iterator[str]:
    at = 0
    while at < len(text):
        found = _PIECE.match(text, at)
        end = found.end() if found and found.end() > at else len(text)
        yield text[at:end]
        at = end


def _longest(text: str) -> int:
    return max((len(piece.strip()) for piece in pieces(text)), default=0)


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * max(0, len(widths) - 1)
