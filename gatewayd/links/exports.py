"""What a kind of link writes for other tools: the part of the contract for `gatewayd export`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


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
class Export:
    """A file for another tool, made from a plan."""

    name: str
    """Of the command: `eds`."""
    summary: str
    """One line for the list of commands."""
    help: str
    example: str
    """A command line."""
    make: Callable[..., str]
    """The text, of a plan and of the options by name. Raises ExportError."""
    options: tuple[ExportOption, ...] = ()
