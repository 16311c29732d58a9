"""Slips of the pen behind what a parser says: characters that look like others, a missing space, a space too many."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from gatewayd.report.format import counted

_QUOTES: Final = "\u201c\u201d\u201e\u201f\u2018\u2019\u201a\u201b\u00ab\u00bb\u2039\u203a"
_DASHES: Final = "\u2010\u2011\u2012\u2013\u2014\u2212\uff0d"
_COLON: Final = "\uff1a"
_NO_SPACE = re.compile(r"(?P<head>\s*(?:- )?(?P<key>[A-Za-z_][A-Za-z0-9_-]*)):(?P<value>[^\s:].*)")
_KEY = re.compile(r"(?P<indent> *)(?P<key>[A-Za-z_][A-Za-z0-9_-]*)\s*:(?P<value>\s+[^\s#].*)?")
_COMMENT = re.compile(r"(?:^|\s)#.*")


@dataclass(frozen=True, slots=True)
class Slip:
    """What is wrong with a line, and how to mend it."""

    line: int
    """Counted from 1, as the column."""
    column: int
    message: str
    hint: str


def lookalike(text: str) -> str:
    """The remedy for the first character that looks like one of YAML and is another; empty if there is none."""
    for character in text:
        if _is_strange_space(character):
            return f"there is a {_named(character)} in it: retype the line with ordinary spaces"
        if character in _QUOTES:
            return f'`{character}` is not a quotation mark in YAML: write " or leave it out'
        if character in _DASHES:
            return f"`{character}` is a {_named(character)}: write an ordinary minus, -"
        if character == _COLON:
            return f"`{character}` is a {_named(character)}: write an ordinary colon and a space"
    return ""


def strange_indent(key: str) -> tuple[str, str] | None:
    """What is wrong with a key that only seems to be indented, and how to mend it: all below it is elsewhere."""
    return _strange_space(key[0]) if key and _is_strange_space(key[0]) else None


def slip_in(lines: Sequence[str], first: int, last: int) -> Slip | None:
    """The slip for which lines `first` to `last` (counted from 1) are no YAML, if it is a usual one."""
    for number in range(first, last + 1):
        line = _COMMENT.sub("", lines[number - 1]) if number <= len(lines) else ""
        column = next((at for at, character in enumerate(line) if _is_strange_space(character)), None)
        if column is not None:
            return Slip(number, column + 1, *_strange_space(line[column]))
    for number in range(max(first, 1), min(last, len(lines)) + 1):
        line = _COMMENT.sub("", lines[number - 1])
        if (found := _NO_SPACE.fullmatch(line)) is not None:
            key, value = found["key"], found["value"].strip()
            message = f"`{key}:{value}` has no space after the colon"
            return Slip(number, found.end("head") + 1, message, f"write `{key}: {value}`")
    return _too_deep(lines, last)


def _too_deep(lines: Sequence[str], number: int) -> Slip | None:
    """A key that stands deeper than the one above it, which has its value already."""
    here = _KEY.match(lines[number - 1]) if 0 < number <= len(lines) else None
    before = [(at, line) for at, line in enumerate(lines[: number - 1], 1) if _COMMENT.sub("", line).strip()]
    above = _KEY.match(before[-1][1]) if before else None
    if here is None or above is None or above["value"] is None or len(here["indent"]) <= len(above["indent"]):
        return None
    message = f"`{here['key']}` is indented deeper than `{above['key']}` above, which has its value already"
    hint = f"begin both with {counted(len(above['indent']), 'space')}, or put the value in quotes"
    section = _KEY.match(before[-2][1]) if len(before) > 1 else None
    if section is not None and section["value"] is None and len(section["indent"]) == len(above["indent"]):
        spaces = counted(len(here["indent"]), "space")
        hint = f"begin both with {spaces}: they belong to `{section['key']}`, which has nothing below it otherwise"
    return Slip(number, len(here["indent"]) + 1, message, hint)


def _strange_space(character: str) -> tuple[str, str]:
    return f"a {_named(character)} stands in place of a space", "retype the line with ordinary spaces"


def _named(character: str) -> str:
    return f"{unicodedata.name(character, 'control character').lower()} (U+{ord(character):04X})"


def _is_strange_space(character: str) -> bool:
    """Whether it is seen as a space or not at all, and is no space, tab or printed character."""
    return character != "\t" and not character.isprintable()
