"""What is looked at where a mapping is to run (`gatewayd doctor`): the part that a kind of link has in it.

The declaration of a kind names the module (`LinkKind.doctor`), whose `EXAMINATION` is one. It looks and writes nothing:
not to a robot, not on a bus, not to this machine.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

from gatewayd.core.definition import CellDefinition
from gatewayd.mapping.plan import LinkPlan


class Outcome(Enum):
    """What came of a check."""

    OK = "ok"
    NOTE = "note"
    """Nothing to do, but worth knowing."""
    SKIPPED = "skipped"
    """Not looked at; the text says why, and what to do to have it looked at."""
    WARNING = "warning"
    """The cell works, but not as it should or for long."""
    PROBLEM = "problem"
    """The cell, or a part of it, does not work."""

    @property
    def is_finding(self) -> bool:
        """Whether there is something to do."""
        return self in {Outcome.WARNING, Outcome.PROBLEM}


@dataclass(frozen=True, slots=True)
class Observation:
    """One line: what was looked at and what was found. May have texts from outside, which are not printable yet."""

    check: str
    """In a word or two: `route`, `bit rate`."""
    outcome: Outcome
    text: str
    """What was found."""
    cause: str = ""
    """Of a finding: what it probably comes from."""
    remedy: str = ""
    """Of a finding: what to do, in the imperative."""

    @classmethod
    def well(cls, check: str, text: str) -> Observation:
        """Nothing is wrong."""
        return cls(check, Outcome.OK, text)


@dataclass(frozen=True, slots=True)
class RunningCell:
    """A cell that a gateway on this machine serves now."""

    socket: str
    """Control socket of the gateway."""
    status: Mapping[str, Any]
    """As the control interface has it (`CellStatus`, and the objects of its links)."""
    variables: Sequence[Mapping[str, Any]] = ()
    """Its variables as the control interface has them (`VariableStatus`)."""

    @property
    def name(self) -> str:
        """Of the cell."""
        return str(self.status.get("name", ""))

    def links(self, title: str) -> Iterator[Mapping[str, Any]]:
        """What it says of its links of the kind with this title (`LinkKind.fields`)."""
        for link in self.status.get("links", ()):
            found = self.status.get(link.get("name"))
            if link.get("title") == title and found:
                yield found


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What an examination has to know besides the plan."""

    running: tuple[RunningCell, ...] = ()
    """Cells that are served on this machine."""
    probe_claims: bool = False
    """Whether inputs may be taken from others for a moment, to see who holds them."""


class Examination:
    """Looks at what one kind of link needs."""

    def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """What is found, in the order in which one thing needs the other; each within a bounded time.

        It never raises for what it meets outside, and stops where the rest cannot be looked at.
        """
        raise NotImplementedError
