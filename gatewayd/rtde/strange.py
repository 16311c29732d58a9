"""Whole packages that cannot be taken as they came: what is odd about them, and how often. They end no session.

Only a package whose size is less than its own header shows that the stream is cut wrongly; everything else that one
does not understand ends where its header says, and what follows is RTDE again.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import Enum

from gatewayd.report.format import counted
from gatewayd.rtde.messages import DataPackage, PackageType

_MOST_REPORTED = 64


class Oddity(Enum):
    """What is odd about a package; the words are stable names for logs and metrics."""

    UNKNOWN_TYPE = "unknown type"
    """Its type is none of the guides'."""
    LAYOUT = "layout"
    """Its payload is not laid out as its type says: too short, or longer than what is known of it."""
    RECIPE = "recipe"
    """Data of another recipe, or of another length, than was agreed."""
    UNEXPECTED = "unexpected"
    """An answer to nothing that was asked, or one that contradicts what was asked."""


@dataclass(frozen=True, slots=True)
class StrangePackage:
    """A package that was passed over, or read only as far as it is known (then its message follows)."""

    oddity: Oddity
    type: int
    """Third byte of the package."""
    reason: str
    """What is wrong with it, in words."""
    data: bytes = b""
    """Its first bytes, for people."""

    def __str__(self) -> str:
        return f"{self.reason}: {self.data.hex(' ')}" if self.data else self.reason


@dataclass(slots=True)
class StrangeCounts:
    """How many there were, and which of them were reported already."""

    by_oddity: dict[Oddity, int] = field(default_factory=lambda: dict.fromkeys(Oddity, 0))
    _reported: set[tuple[Oddity, int]] = field(default_factory=set)

    @property
    def total(self) -> int:
        """All of them."""
        return sum(self.by_oddity.values())

    def count(self, package: StrangePackage) -> bool:
        """Count a package; whether it is the first of its oddity and type, and so to be reported."""
        self.by_oddity[package.oddity] += 1
        key = package.oddity, package.type
        if key in self._reported or len(self._reported) >= _MOST_REPORTED:
            return False
        self._reported.add(key)
        return True


def odd_data(packages: Iterable[DataPackage], recipe: int | None, size: int) -> Iterator[StrangePackage]:
    """Those of `packages` that are not of the agreed recipe, whose values have `size` bytes."""
    for package in packages:
        length = len(package.payload)
        if package.recipe != recipe:
            reason = f"data package of recipe {package.recipe} where {recipe} was agreed"
        elif length != size:
            reason = f"data package with {counted(length, 'byte')} of values, the recipe has {size}"
        else:
            continue
        yield StrangePackage(Oddity.RECIPE, PackageType.DATA_PACKAGE, reason)
