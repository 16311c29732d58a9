"""What a kind of link writes for other tools: the part of the contract for `gatewayd export`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gatewayd.mapping.plan import Plan


class ExportError(Exception):
    """There is nothing to write, or it must not be written; the text says why."""


@dataclass(frozen=True, slots=True)
class Export:
    """A file for another tool, made from a plan."""

    name: str
    """Of the command: `eds`."""
    summary: str
    """One line for the list of commands."""
    help: str
    example: str
    """A command line."""
    make: Callable[[Plan], str]
    """The text. Raises ExportError."""
