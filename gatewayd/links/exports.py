"""What a kind of link writes for other tools: the part of the contract for `gatewayd export`."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final


class ExportError(Exception):
    """There is nothing to write, or it must not be written; the text says why."""


@dataclass(frozen=True, slots=True)
class ExportOption:
    """Something that the mapping cannot say: an option of the command."""

    flag: str
    """`--writer`; what `make` gets has this name without the dashes."""
    help: str
    metavar: str = ""
    """Empty: it takes no value."""
    default: str | None = None
    choices: tuple[str, ...] = ()
    """The only values, if there are any."""
    required: bool = False
    multiple: bool = False

    @property
    def name(self) -> str:
        """What `make` gets the value by."""
        return self.flag.lstrip("-").replace("-", "_")


@dataclass(frozen=True, slots=True)
class ExportCommand:
    """What a command of `gatewayd export` is called, and what it says of itself."""

    name: str
    """Of the command: `eds`."""
    summary: str
    """One line for the list of commands."""
    help: str
    examples: tuple[str, ...]
    """Command lines."""
    options: tuple[ExportOption, ...]


@dataclass(frozen=True, slots=True)
class Export(ExportCommand):
    """A file for another tool, made from a plan."""

    make: Callable[..., str]
    """The text, of a plan and of the options by name. Raises ExportError."""

    def joined(self, other: AnyExport) -> AnyExport:
        """Refused: a file has one writer."""
        raise TypeError(f"two kinds of link write {self.name} ({other.summary})")


@dataclass(frozen=True, slots=True)
class ExportedFile:
    """One of several files. Its text has `CHECKSUM` in a comment, where there is a place for comments."""

    name: str
    text: str
    encoding: str = "utf-8"
    line_end: str = "\n"
    once: bool = False
    """It is a beginning to be worked on: it is written where there is none, and is nobody's but the user's then."""

    def content(self) -> bytes:
        """What stands in the file."""
        text = self.text.replace(CHECKSUM, f"{_MARK}{_checksum(self.text)}")
        return text.replace("\n", self.line_end).encode(self.encoding)


@dataclass(frozen=True, slots=True)
class ExportWay:
    """How one kind of link writes a set of files."""

    link: str
    """Key of the kind: `modbus`."""
    has: Callable[[Any], bool]
    """Whether a plan has such a link."""
    make: Callable[..., Sequence[ExportedFile]]
    """The files, of a plan and of the options by name. Raises ExportError."""


@dataclass(frozen=True, slots=True)
class ExportSet(ExportCommand):
    """Several files for another tool, which several kinds of link may write, each its own."""

    ways: tuple[ExportWay, ...]
    """In the order in which they are preferred, where a plan has several."""

    def joined(self, other: AnyExport) -> ExportSet:
        """The set of both: alike but for who writes it."""
        if not isinstance(other, ExportSet) or replace(other, ways=()) != replace(self, ways=()):
            raise TypeError(f"two kinds of link say different things of {self.name}")
        return replace(self, ways=(*self.ways, *other.ways))

    @property
    def link_option(self) -> ExportOption:
        """By which link, where a cell has several."""
        keys = tuple(way.link for way in self.ways)
        return ExportOption(
            "--link", f"By which link, where the cell has several; otherwise {' before '.join(keys)}.", "LINK",
            choices=keys,
        )  # fmt: skip

    def make(self, plan: Any, *, link: str | None = None, **options: object) -> Sequence[ExportedFile]:
        """The files. Raises ExportError."""
        for way in self.ways:
            if way.link == link or (link is None and way.has(plan)):
                return way.make(plan, **options)
        raise ExportError(
            f"{plan.source}: the cell has no link of these: {', '.join(way.link for way in self.ways)}"
        )


AnyExport = Export | ExportSet


_MARK: Final = "gatewayd-checksum: "
CHECKSUM: Final = f"{_MARK}{'0' * 16}"
"""Stands in a text where its checksum belongs."""
_MARKED: Final = re.compile(rf"{_MARK}([0-9a-f]{{16}})")


def is_as_generated(content: bytes) -> bool:
    """Whether a file is one of ours that nobody has changed; line ends and a byte order mark do not count."""
    text = content.decode("utf-8", errors="replace").removeprefix("\ufeff").replace("\r\n", "\n")
    found = _MARKED.search(text)
    return found is not None and found[1] == _checksum(text)


def _checksum(text: str) -> str:
    """Of the text without its own checksum."""
    return hashlib.sha256(_MARKED.sub(CHECKSUM, text, count=1).encode()).hexdigest()[:16]
