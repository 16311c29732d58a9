"""What there is to say about a register list: errors, and doubts that a person has to settle."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

MAX_ERRORS: Final = 200
"""So many are listed: a list that is read the wrong way has one in every cell."""


@dataclass(frozen=True, slots=True, order=True)
class ListFinding:
    """One of them, at its cell."""

    line: int
    column: int
    text: str
    is_error: bool = True
    hint: str = ""


@dataclass(slots=True)
class ListFindings:
    """All of them. Of a doubt that every row has, the first is kept, with the number of the others."""

    found: list[ListFinding] = field(default_factory=list)
    errors: int = 0
    _repeated: dict[str, list[ListFinding]] = field(default_factory=dict)

    def error(self, place: tuple[int, int], text: str, hint: str = "") -> None:
        """Something that keeps the list from being imported."""
        self.errors += 1
        if self.errors <= MAX_ERRORS:
            self.found.append(ListFinding(*place, text, is_error=True, hint=hint))

    def doubt(self, place: tuple[int, int], text: str, hint: str = "") -> None:
        """Something that was understood in one of several ways."""
        self.found.append(ListFinding(*place, text, is_error=False, hint=hint))

    def repeated_doubt(self, place: tuple[int, int], text: str, hint: str) -> None:
        """A doubt that may be the same in every row: said once."""
        self._repeated.setdefault(text, []).append(ListFinding(*place, text, is_error=False, hint=hint))

    @property
    def failed(self) -> bool:
        """Whether there is an error."""
        return self.errors > 0

    def all(self) -> list[ListFinding]:
        """By line and column; of very many errors the first."""
        merged = []
        for same in self._repeated.values():
            first, more = same[0], f" (and {len(same) - 1} more)" if len(same) > 1 else ""
            merged.append(
                ListFinding(first.line, first.column, first.text + more, is_error=False, hint=first.hint)
            )
        listed = sorted([*self.found, *merged])
        if self.errors > MAX_ERRORS:
            last = listed[-1]
            listed.append(ListFinding(last.line, last.column, f"and {self.errors - MAX_ERRORS} more"))
        return listed
