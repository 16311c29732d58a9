"""What compiling mapping files came to, in a form that travels between processes: records, no trees and no models."""

from __future__ import annotations

from dataclasses import dataclass

from gatewayd.mapping.diagnostics import Diagnostic, Severity
from gatewayd.mapping.plan import Plan


@dataclass(frozen=True, slots=True)
class Unreadable:
    """A file that could not be read."""

    name: str
    reason: str
    """In the operating system's words."""


@dataclass(frozen=True, slots=True)
class CompiledFile:
    """A file that could be read."""

    name: str
    """Path as given."""
    diagnostics: tuple[Diagnostic, ...]
    """All findings, from top to bottom."""
    plan: Plan | None
    """None when a finding is an error."""

    @property
    def errors(self) -> tuple[Diagnostic, ...]:
        """The findings for which there is no plan."""
        return tuple(found for found in self.diagnostics if found.severity is Severity.ERROR)


@dataclass(frozen=True, slots=True)
class Compiled:
    """All files together, in the order in which they were named."""

    files: tuple[CompiledFile, ...] = ()
    unreadable: tuple[Unreadable, ...] = ()

    @property
    def plans(self) -> tuple[Plan, ...]:
        """What can be served."""
        return tuple(file.plan for file in self.files if file.plan is not None)
