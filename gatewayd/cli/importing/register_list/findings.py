"""What there is to say about a register list: errors, and doubts that a person has to settle."""

from __future__ import annotations

from dataclasses import dataclass, field


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
    _repeated: dict[str, list[ListFinding]] = field(default_factory=dict)

    def error(self, place: tuple[int, int], text: str, hint: str = "") -> None:
        """Something that keeps the list from being imported."""
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
        return any(finding.is_error for finding in self.found)

    def all(self) -> list[ListFinding]:
        """By line and column."""
        merged = []
        for same in self._repeated.values():
            first, more = same[0], f" (and {len(same) - 1} more)" if len(same) > 1 else ""
            merged.append(
                ListFinding(first.line, first.column, first.text + more, is_error=False, hint=first.hint)
            )
        return sorted([*self.found, *merged])
