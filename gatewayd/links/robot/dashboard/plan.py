"""The compiled dashboard server of a mapping: how to reach it, and what numbers mean. Immutable."""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.mapping.plan import LinkPlan


@dataclass(frozen=True, slots=True)
class DashboardPlan(LinkPlan):
    """Which variables are its commands and states, the definition of the cell says (`Variable.via`)."""

    kind = "dashboard"

    host: str
    port: int
    period: float
    """Seconds between two rounds of questions."""
    programs: tuple[tuple[int, str], ...] = ()
    """Number and file of what `load` can load."""

    def file_of(self, number: int) -> str | None:
        """The program with this number."""
        return dict(self.programs).get(number)

    def number_of(self, path: str) -> int:
        """The number of a loaded program by its path in the controller; 0: none of them."""
        found = [
            (len(file), number)
            for number, file in self.programs
            if path == file or path.endswith("/" + file.lstrip("/"))
        ]
        return max(found)[1] if found else 0
