"""What there is to say about a file that is imported: errors, doubts that a person has to settle, notes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum


class FindingKind(Enum):
    """What a finding means for the result."""

    ERROR = "error"
    """It cannot be carried over."""
    DOUBT = "doubt"
    """It was understood in one of several ways."""
    NOTE = "note"
    """It is carried over, otherwise than it was written."""


@dataclass(frozen=True, slots=True)
class ImportFinding:
    """One of them, at its place in the file."""

    line: int
    column: int
    """0: the line as a whole."""
    text: str
    kind: FindingKind = FindingKind.ERROR
    hint: str = ""
    file: str = ""
    """Of several; empty: the one that is imported."""

    def __str__(self) -> str:
        return "\n".join(self.lines(self.file))

    @property
    def is_error(self) -> bool:
        """Whether something is not carried over."""
        return self.kind is FindingKind.ERROR

    @property
    def place(self) -> tuple[int, int]:
        """To sort by."""
        return self.line, self.column

    def lines(self, file: str) -> Iterator[str]:
        """As commands print it; `file`: what that is called to which it belongs."""
        column = f":{self.column}" if self.column else ""
        yield f"{file}:{self.line}{column}: {self.kind.value}: {self.text}"
        if self.hint:
            yield f"    hint: {self.hint}"
