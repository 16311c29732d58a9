"""Choosing names by a pattern, in time that grows with the length of a name alone, whatever the pattern is."""

from __future__ import annotations

from collections import defaultdict

MAX_PATTERN = 128
"""Characters of a pattern: twice the longest name of a variable."""


class NamePattern:
    """`*` is any text and `?` any character; everything else is itself, brackets too. Raises ValueError: too long."""

    def __init__(self, text: str) -> None:
        if len(text) > MAX_PATTERN:
            raise ValueError(f"has {len(text)} characters, at most {MAX_PATTERN} are allowed")
        # All states of the pattern's automaton are the bits of one number (shift-and, of Baeza-Yates and Gonnet): bit n
        # is set while the first n characters of the pattern, stars apart, fit what was read. One step a character.
        self._stars = self._any = position = 0
        own: defaultdict[str, int] = defaultdict(int)
        for character in text:
            if character == "*":
                self._stars |= 1 << position
                continue
            if character == "?":
                self._any |= 1 << position
            else:
                own[character] |= 1 << position
            position += 1
        self._fits = {character: bits | self._any for character, bits in own.items()}
        self._end = 1 << position

    def fits(self, name: str) -> bool:
        """Whether the whole name fits."""
        state, fits, any_, stars = 1, self._fits, self._any, self._stars
        for character in name:
            state = (state & fits.get(character, any_)) << 1 | state & stars
            if not state:
                return False
        return bool(state & self._end)
