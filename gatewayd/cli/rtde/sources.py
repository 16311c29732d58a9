"""Where a recording's packages come from: what both sources have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from gatewayd.cli.rtde.recorder import SourceLayout, Values


class SourceLostError(Exception):
    """No more packages come; the text says why."""


class SourceRefusedError(Exception):
    """The packages that are wanted cannot be had; the text says why, and what to do."""


@dataclass(frozen=True, slots=True)
class Arrivals:
    """What came together."""

    packages: Sequence[tuple[Values, float]] = ()
    """Flat values, and when they were received, in seconds since 1970."""
    lost: str = ""
    """Why packages are missing behind these, in words."""
    waiting: str = ""
    """Why none come at present, in words."""
    notes: Sequence[str] = ()
    """What else there is to say, a line each."""


class PackageSource(Protocol):
    """Packages of one robot. `open`, then `next` again and again, then `close`."""

    waiting: str
    """While it is being opened: what it waits for, in words."""

    async def open(self) -> SourceLayout:
        """Connect. SourceLostError, SourceRefusedError."""

    async def next(self, patience: float) -> Arrivals:
        """What comes next; nothing after `patience` seconds. SourceLostError at the end, SourceRefusedError."""

    async def close(self) -> None:
        """Give everything back."""
